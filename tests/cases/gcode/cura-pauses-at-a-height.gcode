;FLAVOR:Marlin
;LAYER_COUNT:1
M82
G28
G1 X-2 Y20 Z0.3 F5000
G1 X-2 Y200 E15
G1 X-1.6 Y200
G1 X-1.6 Y20 E30
G92 E0
;LAYER:0
;TYPE:WALL-OUTER
G0 X100 Y100 Z0.3
G1 X120 Y100 E0.7
G1 X120 Y120 E1.4
;TYPE:CUSTOM
;added code by post processing
;script: PauseAtHeight.py
G1 X190 Y190 F9000
@pause now change filament
G1 X120 Y120 F9000
;TIME_ELAPSED:12.5
G91 ;Relative positioning
G1 E-2 F2700 ;Retract a bit
G1 E-2 Z0.2 F2400 ;Retract and raise Z
G1 X5 Y5 F3000 ;Wipe out
G1 Z10 ;Raise Z more
G90 ;Absolute positioning
G1 X0 Y235 ;Present print
M106 S0
M104 S0
M140 S0
M84 X Y E
;End of Gcode
