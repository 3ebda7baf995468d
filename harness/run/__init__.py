"""One cross-check: plan, load, bind, stream, certify, explain."""
