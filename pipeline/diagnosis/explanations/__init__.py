"""Which causes explain what the base model leaves: candidates refitted, classes, two at once, the conclusion."""
