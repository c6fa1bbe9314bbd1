"""Statistics of residuals and candidates: scores, twins, pairs, leftover, verdict, gain; nothing here is fitted."""
