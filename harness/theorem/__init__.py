"""What is proven of two descriptions at every configuration, from their numbers alone: no engine, no premise."""
