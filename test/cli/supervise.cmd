# A person at the terminal: lines of standard input are commands.
copy small.yaml
$ (sed 's/^task:/rgbd: {width: 96, height: 72}\n&/' small.yaml; echo '  visibility: 0.5') > watched.yaml
exit 0

# Consent to the second plan; what cannot be understood is answered and changes nothing.
$ printf 'no\nhalt\nforbid 9 9\nyes\n' | omentum retract watched.yaml -q -o run --supervise --approve
exit 0
out of the ROI exposed after
err plan 1
err may this plan begin\? yes or no
err plan 2
err "halt" is no command; say pause, go
err forbid needs a block: two numbers from 1 to 5

# Nobody answers: the operation ends, and nothing was done.
$ omentum retract watched.yaml -q -o run2 --supervise --approve < /dev/null
exit 1
out aborted after 0 actions
err nobody answers: the operation ends

# A pause waits for go.
$ printf 'pause\ngo\n' | omentum retract watched.yaml -q -o run3 --supervise
exit 0
out of the ROI exposed after

$ omentum retract watched.yaml -q -o run4 --approve
exit 2
err --approve needs --supervise
