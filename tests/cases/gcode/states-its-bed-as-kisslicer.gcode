; KISSlicer - FREE
; bed_size_x_mm = 180
; bed_size_y_mm = 190
; bed_size_z_mm = 150
; bed_offset_x_mm = 90
; bed_offset_y_mm = 95
; round_bed = 0
M83
G28
G1 X-85 Y-90 Z0.2 F6000
G1 X-65 Y-90 E0.7
G1 X-65 Y-70 E0.7
G1 X-85 Y-70 E0.7
G1 X-85 Y-90 E0.7
M104 S0
M140 S0
M84
