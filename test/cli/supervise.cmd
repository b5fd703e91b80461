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
err another plan follows
err the plan begins

# Nobody answers: the operation ends, and nothing was done.
$ omentum retract watched.yaml -q -o run2 --supervise --approve < /dev/null
exit 1
out aborted after 0 actions
err nobody answers: the operation ends

# A pause waits for go. Help lists what may be typed; no bar is drawn between.
$ printf 'help\npause\ngo\nslow 0.5\n' | omentum retract watched.yaml -o run3 --supervise
exit 0
out of the ROI exposed after
err attach 3 2     the tissue under it is attached
err paused: the arms stand still; say go to continue
err the operation continues
err motions at 50 % of their speed
err PSM1 reaches

$ omentum retract watched.yaml -q -o run4 --approve
exit 2
err --approve needs --supervise
