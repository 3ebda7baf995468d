"""Who computes forward kinematics: one file an engine, all behind `base.Engine`."""
