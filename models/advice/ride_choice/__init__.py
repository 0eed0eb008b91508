"""The effects that a ride scene's quantities call for: screened by adjoint, chosen by what they save, confirmed."""
