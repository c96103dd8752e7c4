"""From archived trials to a verdict on published scores."""
