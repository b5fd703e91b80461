# omentum study learning, trained to the end: two seeds of PPO and cloning on the task "reach".
$ omentum study learning -t reach --same-task --learners ppo,clone --seeds 2 -n 81920 --no-reality -q -o out
exit 0
out ^ppo +1\.000 +1\.000 +-
out ^clone +[01]\.[0-9]+
out ^criteria: met$
no-err
$ ls out
exit 0
out ^clone-1$
out ^clone-2-training.csv$
out ^demos.hdf5$
out ^ppo-1$
out ^ppo-2-training.csv$
out ^report.html$
out ^study.json$
# Finished trainings and evaluations are kept: the same numbers again.
$ cp out/study.json first.json && $OMENTUM study learning -t reach --same-task --learners ppo,clone --seeds 2 -n 81920 --no-reality -q -o out > /dev/null; grep -v seconds first.json > a; grep -v seconds out/study.json | cmp - a && echo same
exit 0
out ^same$
# A score that was changed by hand is used only with the policy of its line.
$ sed -i '1s/.*/# policy 0/;2s/.*/0.5/' out/ppo-1-training.csv && $OMENTUM study learning -t reach --same-task --learners ppo,clone --seeds 2 -n 81920 --no-reality -q -o out > /dev/null; grep -v seconds out/study.json | cmp - a && echo same
exit 0
out ^same$
# PPO in two parts: the second one begins with the policy of the first one, kept in a folder of its own.
$ omentum study learning -t reach --same-task --learners ppo --seeds 1 -n 40960 --varied-steps 40960 --no-reality -q -o two && ls two
exit 0
out ^ppo +1\.000 +1\.000 +-
out ^ppo-1$
out ^ppo-1-plain$
