"""From a result to files people and programs read: html, csv, index."""
