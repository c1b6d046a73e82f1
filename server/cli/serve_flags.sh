# shellcheck shell=bash
# What server/run knows of the flags of `penumbra serve` before there is a penumbra to ask. The table is what --help says of
# their values; tests/setup compares the two.
serve_flags='--listen TEXT
--admin-listen TEXT
--threads INT:INT in [-2 - 4096]
--jobs INT:INT in [1 - 1024]
--queue UINT:INT in [0 - 1000000]
--queue-bytes BYTES:SIZE [b, kb(=1024b), ...]
--store DIR
--job-time-limit S:NONNEGATIVE
--normal-priority
--log-level TEXT:{debug,info,warning,error,off}
--log-format TEXT:{json,text}
--keep-jobs UINT:POSITIVE
--keep-jobs-days FLOAT:POSITIVE
--keep-images BYTES:SIZE [b, kb(=1024b), ...]
--keep-scenes BYTES:SIZE [b, kb(=1024b), ...]
--keep-images-hours FLOAT:POSITIVE
--disk-reserve BYTES:SIZE [b, kb(=1024b), ...]
--keys FILE
--key-requests INT:NONNEGATIVE
--key-jobs UINT:NONNEGATIVE
--cors-origin ORIGIN ...
--host NAME ...
--allow-public
--max-connections UINT:INT in [0 - 100000]
--max-streams UINT:INT in [1 - 10000]
--max-client-streams UINT:INT in [1 - 10000]
--max-head BYTES:SIZE [b, kb(=1024b), ...]:INT in [1024 - 1048576]
--request-timeout S:FLOAT in [0.1 - 3600]
--idle-timeout S:FLOAT in [0.1 - 3600]
--max-body BYTES:SIZE [b, kb(=1024b), ...]:POSITIVE
--max-json-depth INT:POSITIVE
--max-json-values UINT:POSITIVE
--max-string BYTES:SIZE [b, kb(=1024b), ...]:POSITIVE
--max-primitives UINT:POSITIVE
--max-lights UINT:POSITIVE
--max-polygon-vertices UINT:POSITIVE
--max-triangles UINT:POSITIVE
--max-edge-pixels INT:POSITIVE
--max-pixels INT:POSITIVE
--max-samples INT:POSITIVE
--max-depth INT:POSITIVE
--max-work FLOAT:POSITIVE
--max-memory BYTES:SIZE [b, kb(=1024b), ...]:POSITIVE'

refuse() { echo "server/run: $1" >&2; exit 2; }

refuse_name() { refuse "there is no $1; its flags are $(sed 's/ .*//' <<<"$serve_flags" | sort | tr '\n' ' ')"; }

kind_of() { # FLAG: what the table says of it
  local name kind
  while read -r name kind; do
    [[ $name != "$1" ]] || { echo "$kind"; return; }
  done <<<"$serve_flags"
  return 1
}

is_within() { awk -v value="$1" -v low="$2" -v high="$3" 'BEGIN { exit !(value + 0 >= low + 0 && value + 0 <= high + 0) }'; }

# must_be FLAG KIND VALUE: refuses what penumbra would. What has a unit or is hexadecimal may still be too much for it.
must_be() {
  local flag=$1 kind=$2 value=${3,,} what='' pattern='' low='' high=''
  local sign='^ *[+-]?' decimal='([0-9]+\.?[0-9]*|\.[0-9]+)(e[+-]?[0-9]+)?' hexadecimal='0x[0-9a-f]+'
  case "$flag $kind" in
    --*listen' '*) what=HOST:PORT pattern='^([^:]+|\[.+\]):[0-9]+$' low=0 high=65535 ;;
    *{*) what="one of ${kind#*:}" value=$3 pattern=${kind#*\{} && pattern="^(${pattern%\}})$" pattern=${pattern//,/|} ;;
    *' BYTES:'*) what='a number of bytes, such as 8M' pattern="^ *[+]?([0-9]+|$hexadecimal) *([kmgtpe]i?)?b?$" ;;
    *' FLOAT:'* | *' S:'*) what='a number' pattern="$sign($decimal|$hexadecimal)$" ;;
    *' INT:'* | *' UINT:'*) what='a whole number' pattern="$sign([0-9]+|$hexadecimal)$" ;;
    *' ') what='true or false' pattern='^([0-9+-]+|t|f|y|n|true|false|yes|no|on|off|enable|disable)$' ;;
    *) return 0 ;;
  esac
  case $kind in
    *'in ['*) low=${kind##*[} high=${low#* - } low=${low%% *} high=${high%]} what+=" from $low to $high" ;;
    *:POSITIVE) low=1e-300 high=1e308 what+=' above 0' ;;
    *:NONNEGATIVE) low=0 high=1e308 what+=' not below 0' ;;
  esac
  [[ $value =~ $pattern ]] || refuse "$flag: '$3' is not $what"
  value=${value##*:} # of an address the port has a range
  [[ -z $low || ! $value =~ $sign$decimal$ ]] || is_within "$value" "$low" "$high" || refuse "$flag: '$3' is not $what"
}

must_be_loopback() { # FLAG HOST:PORT REASON
  [[ -z $2 || $2 =~ ^(localhost|.+\.localhost|127\..+|\[[0:]*:0*1\]):[0-9]+$ ]] ||
    refuse "$1: others can reach ${2%:*}, and $3; --allow-public if that is meant"
}

# must_be_flags ARGUMENT...: refuses what penumbra serve would. A flag's twin in the environment counts where it is not given.
must_be_flags() {
  local flag kind twin
  local -A given=()
  while (($#)); do
    flag=${1%%=*}
    [[ $flag == -* ]] || refuse_name "command $flag"
    kind=$(kind_of "$flag") || refuse_name "flag $flag"
    [[ -z ${given[$flag]-} || -z $kind || $kind == *' ...' ]] || refuse "$flag is given twice"
    if [[ $1 == *=* || -z $kind ]]; then
      [[ $1 == *=* ]] || set -- "$flag=true" "${@:2}"
      given[$flag]=${1#*=}
    else
      (($# > 1)) || refuse "$flag needs a value"
      given[$flag]=$2
      shift
    fi
    must_be "$flag" "$kind" "${given[$flag]}"
    shift
    while [[ $kind == *' ...' && -n ${1-} && $1 != -* ]]; do shift; done # a list goes on
  done
  while read -r flag kind; do
    twin=${flag#--} twin=PENUMBRA_${twin^^} twin=${twin//-/_}
    [[ -z ${given[$flag]-} && -n ${!twin-} ]] || continue
    given[$flag]=${!twin}
    must_be "$twin" "$kind" "${!twin}"
  done <<<"$serve_flags"
  [[ -n ${given[--allow-public]-} ]] || must_be_loopback --admin-listen "${given[--admin-listen]-}" 'it never asks for keys'
  [[ -n ${given[--allow-public]-}${given[--keys]-} ]] || must_be_loopback --listen "${given[--listen]-}" 'no keys are asked for (--keys)'
}
