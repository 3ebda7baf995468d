"""How good the gate is: robot models with a fault put in on purpose, what the gate makes of them, and the score."""
