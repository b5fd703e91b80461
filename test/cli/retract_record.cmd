# omentum retract --record, --acting; omentum replay: the decisions again from the observations alone; motions of a policy.
copy small.yaml

# Reaches and pulls by a policy: another way of the tips, the same outcome. A policy of another task is refused.
$ omentum retract small.yaml -q --json -o lines | grep -o '"path_mm": [0-9.]*' > a; omentum retract small.yaml -q --acting $ROOT/weights/approach.safetensors --json -o policy | grep -o '"path_mm": [0-9.]*' > b; wc -l < a; wc -l < b; cmp -s a b || echo other
exit 0
out ^1$
out ^other$
$ omentum retract small.yaml -q --acting $ROOT/weights/retract_ppo.safetensors -o wrong
exit 3
err motions need a policy of `omentum rl train -t approach`: the policy is of task retract, not of approach
no-file wrong
$ omentum retract small.yaml -q --acting $ROOT/weights/approach.safetensors --record -o wrong
exit 3
err --acting: a run by a policy cannot be replayed; leave out --record
no-file wrong

# Recorded, decided again from the observations alone, and with a changed line.
$ omentum retract small.yaml -q --record -o recorded
exit 0
out ^  observations: recorded/observations\.log, 0\.\d MB; omentum replay recorded decides again from them$
$ omentum replay -q recorded -o recorded-again.jsonl && cmp recorded/audit.jsonl recorded-again.jsonl
exit 0
out ^recorded: decided again from its observations: all \d+ lines are the same, 1 plans in \d\.\d s$
no-err

# A changed scene is named, a record of an older version gets a note.
$ cp -r recorded older && rm older/hashes.json && sed -i 's/^seed: 1$/seed: 2/' recorded/scene.yaml && omentum replay -q recorded
exit 3
err recorded/scene\.yaml was changed since the run was recorded \(hash [0-9a-f]{16}, now [0-9a-f]{16}\): .*put the recorded file back, or .*omentum retract recorded/scene\.yaml --record -o DIR
err-lines 1
$ sed -i 's/^seed: 2$/seed: 1/' recorded/scene.yaml && omentum replay -q older && $OMENTUM replay -q recorded > said && grep -c note said
exit 1
out ^older: decided again from its observations: all \d+ lines are the same
out ^note: the record has no hashes\.json, as older versions made it
out ^0$

$ sed -i '3s/psm1/psm2/' recorded/audit.jsonl && omentum replay -q recorded
exit 1
out ^recorded: line 3 of the audit differs$
out ^\{"event": "begin".*"arm": "psm2"
out ^\{"event": "begin".*"arm": "psm1"
$ omentum replay -q run
exit 3
err run has no observations\.log; record a run by omentum retract --record
err-lines 1
