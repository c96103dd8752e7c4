"""The search for parameters with which the model reproduces measured statistics."""
