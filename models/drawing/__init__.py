"""How every figure looks: sizes, colours, axes."""
