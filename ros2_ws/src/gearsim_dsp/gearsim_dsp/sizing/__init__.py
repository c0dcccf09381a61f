"""How large a fault is: widths of spalls from the way rolling elements cross them."""
