; <IceSL Dec 20 2021 17:10:40>
; bed_size_x_mm : 	300
; bed_size_y_mm : 	300
; bed_size_z_mm : 	250
M83
G28
;<layer 0>
G1 X270 Y270 Z0.2 F6000
G1 X290 Y270 E0.7
G1 X290 Y290 E0.7
G1 X270 Y290 E0.7
G1 X270 Y270 E0.7
M104 S0
M140 S0
M84
