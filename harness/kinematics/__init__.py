"""What a mechanism is: screws, canonical rows, factors."""
