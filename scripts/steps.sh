# For scripts to source: step NAME COMMAND... runs it between two lines, the second with its seconds, of the clock and of the
# processors; its status is the command's.
step() {
  local name=$1 start=$SECONDS status=0 shell=$BASHPID before
  shift
  echo "== $name"
  before=$(processor_seconds "$shell")
  "$@" || status=$?
  echo "== $name: $((SECONDS - start)) s, $(($(processor_seconds "$shell") - before)) CPU s$([ "$status" = 0 ] || echo ", status $status")"
  return "$status"
}
# Of the ended children of a process (proc(5): cutime and cstime).
processor_seconds() { awk -v hz="$(getconf CLK_TCK)" '{ printf "%d", ($16 + $17) / hz }' "/proc/$1/stat"; }
