# For scripts to source: step NAME COMMAND... runs it between two lines, the second with its seconds; its status is the command's.
step() {
  local name=$1 start=$SECONDS status=0
  shift
  echo "== $name"
  "$@" || status=$?
  echo "== $name: $((SECONDS - start)) s$([ "$status" = 0 ] || echo ", status $status")"
  return "$status"
}
