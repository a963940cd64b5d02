"""From the chains of a batch to the results of walks."""
