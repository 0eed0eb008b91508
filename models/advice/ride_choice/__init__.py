"""Choice of effects of linear ride scenes in closed form: which ones the scene's quantities need; screened by adjoints,
chosen by what they save, confirmed.
"""
