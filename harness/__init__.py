"""fk-crosscheck: cross-validation of a robot's DH table against its URDF, with every forward-kinematics engine people use."""

__version__ = "0.1.0"
