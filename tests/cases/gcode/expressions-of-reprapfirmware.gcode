M83
G28
M98 P"/macros/prime.g"
if move.axes[0].homed
  M117 "ready"
set var.x = 3
G1 X{var.x} F3000
G1 X100 Y100 Z0.2 F6000
G1 X120.0 Y100 E0.7
G1 X120.0 Y120.0 E0.7
G1 X100 Y120.0 E0.7
G1 X100 Y100 E0.7
