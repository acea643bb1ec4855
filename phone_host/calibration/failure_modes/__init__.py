"""Why a calibration is not good: each cause is a way in which views may differ from those of one stiff rig, weighed against the others.

Imports `solve`, whose arguments it has, and `target`. `found` is what `calibrate` made of the pairs.
"""
