"""Vehicle models: engine-neutral descriptions, and equations of motion written straight from their papers."""
