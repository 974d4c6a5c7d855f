"""What the frame loop costs and how right it is, measured together and beside what users would otherwise use."""
