"""One cross-check: plan, load, bind, compare, explain, prove, test."""
