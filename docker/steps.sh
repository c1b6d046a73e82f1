# shellcheck shell=bash
# Shared by docker/install-packages, server/run and tests/run: what takes minutes shows how far it is.

# show_step WHAT: in place on a terminal, else a line now and then.
show_step() {
  step=$1
  if [[ -t 1 ]]; then printf '\r\e[K%s' "$step"; return; fi
  ((SECONDS >= next_line)) || return 0
  echo "$step"
  shown=$step next_line=$((SECONDS + 10))
}
begin_steps() { step='' shown='' next_line=0; }
end_steps() { # the last one stays
  if [[ -z $step || $step == "$shown" ]]; then return; fi
  if [[ -t 1 ]]; then echo; else echo "$step"; fi
}

# Reads what apt-get install says on its standard output. It sets some packages up twice.
show_apt() {
  local line packages=0 unpacked=0 set_up=0
  begin_steps
  while IFS= read -r line; do
    case $line in
      [0-9]*' newly installed'*) packages=${line#*, } packages=${packages%% *} ;;
      'Need to get '* | 'After this operation'*) echo "$line" ;;
      Get:*) line=${line#Get:} && show_step "Downloading package ${line%% *} of $packages" ;;
      'Unpacking '*) unpacked=$((unpacked < packages ? unpacked + 1 : packages)) && show_step "Unpacking package $unpacked of $packages" ;;
      'Setting up '*) set_up=$((set_up < packages ? set_up + 1 : packages)) && show_step "Setting up package $set_up of $packages" ;;
    esac
  done
  end_steps
}

# Reads what ninja says. Nothing is shown when there is nothing to build; whatever else it says passes.
show_ninja() {
  local line
  begin_steps
  while IFS= read -r line; do
    case $line in
      *'] Re-checking globbed '* | *'] Re-running CMake'* | '-- '* | 'ninja: no work to do.') ;;
      \[*/*\]*) line=${line#[} line=${line%%]*} && show_step "Building, step ${line%/*} of ${line#*/}" ;;
      *) end_steps; begin_steps; printf '%s\n' "$line" ;;
    esac
  done
  end_steps
}

# build PRESET [--target NAME...]: in the repository's folder.
build() {
  cmake --build --preset "$@" | show_ninja
}

# Said before minutes are spent: a build that root once made here, by sudo, is nobody else's.
must_write_build() {
  local folder=$PWD/build locked
  [[ -e build ]] || folder=$PWD
  locked=$(find "$folder" -maxdepth $([[ $folder == */build ]] && echo 2 || echo 0) ! -writable -printf '%u\n' -quit)
  [[ -z $locked ]] || {
    echo "$folder belongs to $locked and cannot be written: sudo chown -R $(id -un) '$folder'" >&2
    exit 1
  }
}
