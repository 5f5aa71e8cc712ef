#!/usr/bin/env bash
# Registers the job definitions, starts the parts as an array job and gathers when it ends.
# Usage: submit.sh QUEUE [PARTS]
set -euo pipefail
queue=${1:?usage: submit.sh QUEUE [PARTS]} parts=${2:-100}
cd "$(dirname "$0")"
for job in screen gather; do
    aws batch register-job-definition --cli-input-json "file://$job.json" >/dev/null
done
screen=$(aws batch submit-job --job-name tipwatch-screen --job-queue "$queue" --job-definition tipwatch-screen \
    --array-properties "size=$parts" --query jobId --output text)
# AWS Batch drops what depends on a failed job: then start tipwatch-gather by hand, it names the missing logs
aws batch submit-job --job-name tipwatch-gather --job-queue "$queue" --job-definition tipwatch-gather \
    --depends-on "jobId=$screen" --query jobId --output text
