"""Why a calibration is not good: each cause is a way in which views may differ from those of one stiff rig, weighed against the others.

Imports `solve` and `target`.
"""
