# omentum model: files that do not state their unit or space.

# Without a statement: millimetres and RAS are assumed and told; what no body can be is refused with the remedy.
$ printf 'OFF\n4 4 0\n0 0 0\n0.03 0 0\n0 0.03 0\n0 0 0.03\n3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n' > metres.off; omentum model --no-bending metres.off -q -o none
exit 3
err metres\.off: the body is 0\.03 mm long if a unit of the file is 1 mm, as is assumed: state its unit with --unit; --unit m makes it 30 mm and 4\.5 mL
no-file none
$ omentum model --no-bending metres.off --unit m --edge 6 -q -o metres
exit 0
out note: the file does not say whether it is RAS or LPS: RAS is assumed \(--space\)
out volume 4\.\d+ mL
$ sed 's/0\.03/5/g' metres.off > cm.off; omentum model --no-bending cm.off --edge 1 -q -o cm
exit 0
out note: the file does not state its unit: millimetres are assumed \(--unit\)
out note: the body is 5 mm long and has 0\.02083 mL: .* taken as 1 mm, which nothing states; --unit cm makes it 50 mm and 20\.83 mL
$ omentum model --no-bending metres.off --space left -q -o none
exit 2
err --space: "left" is neither ras nor lps
