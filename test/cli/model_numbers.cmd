# omentum model: numbers of the command line end up where they belong, in their units; the references are worked out by hand.
# An ellipsoid of half-axes 22.5, 22.5 and 28.5 mm, longest up the body, its middle at (-45.5, -0.5, -0.5) mm; a lump beside it.
$ (printf 'NRRD0004\ntype: uint8\ndimension: 3\nspace: right-anterior-superior\nsizes: 24 24 24\nspace directions: (3,0,0) (0,3,0) (0,0,3)\nspace origin: (-80,-35,-35)\nencoding: ascii\n\n'; awk 'BEGIN { for (k = 0; k < 24; k++) for (j = 0; j < 24; j++) for (i = 0; i < 24; i++) print (((i-11.5)^2 + (j-11.5)^2) * 1.6 + (k-11.5)^2 < 90) ? 7 : (i < 4 && j < 4 && k < 5) ? 8 : 0 }') > organ.nrrd
exit 0

# 30 x 20 mm of the outline lie askew on the surface, about 1.1 times as large, and half the thickness out by 1.1 times more in each
# direction, less the rounded rim: 2.6 to 3.1 mL. Along is +z, across is y x z = +x.
$ omentum model --no-bending organ.nrrd -l 7 -e 5 --sheet thickness=4,side=anterior,length=30,width=20,corner=2 --tumour radius=6,height=1,along=5,across=-3 --material name=liver,young=5000,density=1060 -q -o s && cat s/patient.yaml
exit 0
out volume (2\.[6-9]\d*|3\.0\d*) mL
out ^    young: 5000$
out ^    density: 1060$
out ^roi_center_mm: \[-4[789]\.\d+, 2[012]\.\d+, [3-5]\.\d+\]
out ^roi_radius_mm: 6$

# The lump has 3.5 % of the voxels, 4.3 % of the elements: kept above 3 %, left out below 20 %.
$ omentum model --no-bending organ.nrrd -l 7,8 -e 5 --min-share 3 --all-parts -q -o all
exit 0
out volume 62\.\d+ mL
$ omentum model --no-bending organ.nrrd -l 7,8 -e 5 --min-share 20 --all-parts -q -o large
exit 0
out volume 60\.\d+ mL
out 2\.16 mL \(3\.5 %\) of the label are left out

# A tetrahedron of 5 cm: 125 / 6 mL.
$ printf 'OFF\n4 4 0\n0 0 0\n5 0 0\n0 5 0\n0 0 5\n3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n' > cm.off; omentum model --no-bending cm.off --unit cm --edge 4 -q -o cm
exit 0
out volume 20\.\d+ mL
