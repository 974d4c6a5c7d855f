"""Path-traced sheets: light transport that none of our formulas produced."""
