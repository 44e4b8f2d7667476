"""Derivations: each step as formula, formula with numbers and value, from the same text."""
