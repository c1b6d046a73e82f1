# Shared by the scripts beside it: where the server is, who asks, and what a refusal looks like.
export LC_ALL=C  # printf takes and prints decimal points
url=${PENUMBRA_URL:-http://127.0.0.1:8080}
while [[ $url == */ ]]; do url=${url%/}; done

usage() { # prints the script's opening comment
  sed -n '2,/^[^#]/s/^# \{0,1\}//p' "$0"
}

# What would fail only after the render is looked at before it.
must_read() { [[ $1 == - || -r $1 && ! -d $1 ]] || { echo "$1 cannot be read" >&2; exit 2; }; }
must_write() {
  [[ $1 == - || -w $1 && ! -d $1 || ! -e $1 && -w $(dirname -- "$1") ]] || { echo "$1 cannot be written" >&2; exit 2; }
}

# call CURL_ARGUMENTS...: curl with the key, in a process's place, for its children may outlive it. Command lines are everybody's to
# read; the key goes through a pipe.
call() {
  [[ -n ${PENUMBRA_KEY-} ]] || exec curl -sS "$@"
  exec curl -sS -H @<(printf 'Authorization: Bearer %s\n' "$PENUMBRA_KEY") "$@"
}

# request OUTPUT CURL_ARGUMENTS...: the answer's body goes to OUTPUT; a refusal is explained on standard error.
request() {
  local output=$1 status
  shift
  body=$(mktemp)
  # Waited for, not run in front: whoever ends the script ends the call.
  trap 'rm -f "$body" "$body.status"; kill "$process" 2>/dev/null || true' EXIT
  call -o "$body" -w '%{http_code}' "$@" <&0 >"$body.status" &
  process=$!
  wait "$process" || return 3
  status=$(<"$body.status")
  if [[ $status != 2?? ]]; then
    echo "$status: $(jq -r '.detail // .title' "$body" 2>/dev/null || cat "$body")" >&2
    jq -r '.errors[]? | "  \(if .pointer == "" then "(body)" else .pointer end): \(.detail)"' "$body" >&2 2>/dev/null || true
    rm -f "$body" "$body.status"
    return 1
  fi
  # Written, not moved: the output may be a device, and keeps its own permissions.
  if [[ $output == - ]]; then cat "$body"; else cat "$body" >"$output"; fi
  rm -f "$body" "$body.status"
}
