"""Compiled formulas on scalars and small arrays; what they mean is said in each."""
