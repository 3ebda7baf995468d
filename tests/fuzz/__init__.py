"""Damaged inputs of every kind, through the command itself: known exit codes, one message, bounded time and memory."""
