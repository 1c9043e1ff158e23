#!/bin/sh
# A whole session. my_robot.yaml is the nominal robot, measurements.csv what a virtual tracker reads of a simulated
# robot at 60 configurations, check.csv what it reads at 15 others.
set -e
cd "$(dirname "$0")"
truearm show my_robot.yaml
truearm calibrate my_robot.yaml measurements.csv --out result
truearm validate result/calibrated.yaml check.csv
echo "Open result/report.html in a browser."
