; the same square drawn in every manner of writing
N1 G21*27
n2 g90 * 50
G92 E0 ; zero
g1x10y+10.e.5f1200
G1 X 20 Y 10 (to the right) E 1.0
 	G01 E1.5 Y20. X20.0
N7 G1 X10.0Y20E2*100
(only a remark)
M83
G1 X1.5E1 Y2 ( unclosed
M117 Half way; X9 Y9 E9
M862.3 P "MK3S X99"