"""From pairs to one metric model: odometry, volume, registration, tracking, mesh. Pure: no I/O, no clock.

Rules: poses are `T_world_camera`, axes as OpenCV's (x right, y down, z forward); depths are metres, NaN = none; pixel centres are integers.
"""
