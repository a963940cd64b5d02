"""Speed and accuracy, measured. Only the command line imports this."""
