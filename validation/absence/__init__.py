"""What a scene does not name is not there: ``probes`` look, ``hand_built`` models set the price to beat."""
