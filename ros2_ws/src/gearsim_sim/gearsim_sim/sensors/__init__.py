"""What the rig's sensors make of the motion: accelerometer chains, tachos and encoders, as table rows."""
