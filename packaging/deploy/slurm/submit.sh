#!/usr/bin/env bash
# Starts the parts, and the gathering when they have ended, however they end.
set -euo pipefail
cd "$(dirname "$0")"
screen=$(sbatch --parsable screen.sbatch)
sbatch --dependency="afterany:$screen" gather.sbatch
