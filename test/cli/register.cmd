# omentum register: points that fit, one that does not, too few, and a file that is none.
write good.csv
    # frame x y z, world x y z, mm
    0, 0, 0, 100, 50, 20
    100 0 0 100 150 20
    0 80 0 20 50 20
    10 20 60 80 60 80
    -30 10 20 90 20 40
$ omentum register good.csv --frame PSM1_base -o frames.json
exit 0
out PSM1_base: 5 points, residuals 0\.00 mm
file frames.json

$ sed 's/^100 0 0.*/100 0 0 100 159 20/' good.csv > off.csv && omentum register off.csv --frame PSM2_base -o other.json
exit 1
out above 2 mm: nothing is written; touch the points again, first that of line 3
no-file other.json

$ omentum register off.csv --frame PSM2_base -o frames.json --limit 20 --json
exit 0
out "worst_line": 3

$ head -4 good.csv > few.csv && omentum register few.csv --frame A -o frames.json
exit 3
err 3 points; at least 4

$ echo "1 2 3 4 5 x" > bad.csv && omentum register bad.csv --frame A -o frames.json
exit 3
err bad\.csv:1: not six numbers

$ omentum register good.csv -o frames.json
exit 2
err --frame and --output are needed
