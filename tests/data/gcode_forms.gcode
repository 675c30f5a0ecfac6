; the same square drawn in every manner of writing
N1 G21*27
n2 g90 * 50
G92 E0 ; zero
g1e.5x10y+10.f1200
G1 X 20 Y 10 E 1.0 ; (to the right)
 	G01 E1.5 Y20. X20.0
N7 G1E2X10.0Y20*68
(only a remark)
M83
G1E1X1.5 Y2 ; ( unclosed
M117 Half way; X9 Y9 E9
M862.3 P "MK3S X99"