"""What is believed after the data: error models, evidence of each hypothesis, and their probabilities."""
