"""What a robot is, read and validated: DH table, URDF, mapping, configurations. Knows no engine."""
