"""The gallery: one picture for every kind of fault, healthy beside faulty."""
