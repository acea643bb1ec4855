"""The calibration target: printed, named, found in images, and its corners there. Imports no other room of the calibration.

Arguments, where a function does not say otherwise: `grey` (H, W) uint8; `image` the same or (H, W, 3) BGR; `corners`, `left`, `right`
(N, 2) float64, px, in the order of `Board.points_m`, NaN where one is not seen, (0, 2) where the board was not found; `columns`, `rows` count
inner corners; sizes are width and height; an image that claims more than `most_pixels` is passed over; `mounted`: how the user says that the
left and the right camera are mounted.
"""
