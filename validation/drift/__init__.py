"""Experiments on attitude and pitch estimation that the validation cases and tests of drift share."""
