# shellcheck shell=bash
# What ./deploy/demo and ./deploy/test share: install what is missing, set the environment, build. Sourced, not run.
#
# Exit codes: 69 something is missing that only you can install, 75 try again later (network, a busy package manager,
# a full disk), otherwise the code of the command that failed.

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
venv=$root/.venv
export CARGO_TARGET_DIR=${CARGO_TARGET_DIR:-$root/target}

readonly CARGO_MIN=1.95
readonly PYTHON_MIN=3.11
readonly FREE_GB_MIN=8
readonly OPENCV_PACKAGES=(
    libopencv-core-dev libopencv-imgproc-dev libopencv-imgcodecs-dev
    libopencv-features2d-dev libopencv-flann-dev libopencv-calib3d-dev
)

# --- talking ---------------------------------------------------------------------------------------------------------

n_step=0
n_steps=0

# begin TITLE: the headline of the next of $n_steps steps.
begin() {
    n_step=$((n_step + 1))
    printf '[%d/%d] %s ... ' "$n_step" "$n_steps" "$1"
}

say() { printf '      %s\n' "$*"; }

# fail CODE SENTENCE..: says what is wrong and what to do about it.
fail() {
    local code=$1
    shift
    printf '\n%s: %s\n' "deploy/$(basename "$0")" "$1" >&2
    shift
    (($# == 0)) || printf '  %s\n' "$@" >&2
    exit "$code"
}

have() { command -v "$1" >/dev/null 2>&1; }

# at_least MINIMUM VERSION: compares dotted numbers.
at_least() { [[ $(printf '%s\n%s\n' "$1" "$2" | sort -V | head -n 1) == "$1" ]]; }

# --- what you bring --------------------------------------------------------------------------------------------------

require_cargo() {
    local get="Get a newer one from https://rustup.rs, or with: rustup update stable"
    # rustup's folder, for a shell that has not read its profile since.
    PATH=$PATH:${CARGO_HOME:-${HOME:-}/.cargo}/bin
    have cargo || fail 69 "cargo was not found; Rust $CARGO_MIN or later is needed." \
        "Install it: curl --proto '=https' --tlsv1.2 -sSf https://sh.rustup.rs | sh"
    local words
    read -r -a words < <(cargo --version 2>&1) || true
    [[ ${words[0]:-} == cargo && ${words[1]:-} =~ ^[0-9] ]] || fail 69 "cargo does not run: ${words[*]:-}" "$get"
    at_least "$CARGO_MIN" "${words[1]}" || fail 69 "cargo ${words[1]} is too old; $CARGO_MIN or later is needed." "$get"
}

# require_component COMMAND NAME: parts of the toolchain that rustup's minimal profile leaves out.
require_component() {
    cargo "$1" --version >/dev/null 2>&1 || fail 69 "cargo $1 was not found." "Install it: rustup component add $2"
}

# A finished build needs no more room; a first one takes about 6 GB, the Python environment 0.9 GB.
require_disk() {
    [[ -x $CARGO_TARGET_DIR/debug/homing ]] && return
    local free_kb
    mkdir -p "$CARGO_TARGET_DIR"
    free_kb=$(df --output=avail -k "$CARGO_TARGET_DIR" | tail -n 1)
    ((free_kb >= FREE_GB_MIN * 1000000)) || fail 75 \
        "only $((free_kb / 1000000)) GB are free under $CARGO_TARGET_DIR; the first build needs $FREE_GB_MIN GB." \
        "Make room, or point CARGO_TARGET_DIR at a larger disk."
}

# --- system packages -------------------------------------------------------------------------------------------------

opencv_by_pkg_config() { have pkg-config && pkg-config --exists opencv4 2>/dev/null; }

have_libclang() {
    [[ -n ${LIBCLANG_PATH:-} ]] && return
    local pattern
    for pattern in '/usr/lib/llvm-*/lib/libclang.so*' '/usr/lib*/libclang.so*' '/usr/lib/*/libclang-[0-9]*.so*'; do
        compgen -G "$pattern" >/dev/null && return
    done
    return 1
}

# The libclang that belongs to this release's `clang`: libclang1-14 on Debian 12, another number elsewhere.
libclang_package() {
    local number name
    number=$(apt-cache depends clang 2>/dev/null | sed -n 's/.*Depends: clang-\([0-9]*\)$/\1/p' | head -n 1)
    for name in "libclang1-${number:-14}" "libclang1-${number:-14}t64" libclang-dev; do
        if apt-cache show "$name" >/dev/null 2>&1; then
            echo "$name"
            return
        fi
    done
    echo libclang1-14
}

# missing_packages: sets `missing`. Looks for what is needed rather than for names where either would do.
missing_packages() {
    local wanted=(mesa-vulkan-drivers)
    missing=()
    opencv_by_pkg_config || wanted+=("${OPENCV_PACKAGES[@]}")
    find_python || wanted+=(python3-venv)
    local installed
    installed=$(dpkg-query -W -f='${db:Status-Status} ${Package}\n' "${wanted[@]}" 2>/dev/null || true)
    local package
    for package in "${wanted[@]}"; do
        grep -qx "installed $package" <<<"$installed" || missing+=("$package")
    done
    have clang || missing+=(clang)
    have_libclang || missing+=(libclang)
    have c++ || missing+=(g++)
    have pkg-config || missing+=(pkg-config)
}

# as_root COMMAND..: sudo where it takes one.
as_root() {
    if ((EUID == 0)); then
        "$@"
    else
        sudo "$@"
    fi
}

# apt_progress: the lines of apt-get that show it advances; that it waits for a lock, once.
apt_progress() {
    sed -u -n -e '/^Waiting/{x;s/^$/      waiting for another package manager/p;x;h}' \
        -e 's/^\(Get:\|Setting up\)/      &/p'
}

install_packages() {
    local packages=("$@") log update
    local by_hand="apt-get install --no-install-recommends ${packages[*]}"
    if ((EUID != 0)); then
        have sudo || fail 69 "system packages are missing, and there is no sudo here." "As root: $by_hand"
        say "sudo is needed for this, and may ask for your password."
        sudo -v || fail 69 "system packages are missing, and sudo refuses." "Have somebody run, as root: $by_hand"
    fi
    log=$(mktemp)
    update=$(mktemp)
    as_root apt-get -q -o DPkg::Lock::Timeout=60 update 2>&1 | tee "$update" | apt_progress || true
    # Only now are the names known on a machine that never fetched its package lists.
    local i
    for i in "${!packages[@]}"; do
        [[ ${packages[i]} == libclang ]] && packages[i]=$(libclang_package)
    done
    if ! as_root env DEBIAN_FRONTEND=noninteractive apt-get -q -y -o DPkg::Lock::Timeout=120 \
        install --no-install-recommends "${packages[@]}" 2>&1 |
        tee "$log" | apt_progress; then
        explain_apt "$log" "$update" "apt-get install --no-install-recommends ${packages[*]}"
    fi
    rm -f "$log" "$update"
}

# explain_apt LOG UPDATE_LOG COMMAND: why apt-get failed, as a sentence.
explain_apt() {
    if grep -qE 'Could not get lock|Unable to acquire|is held by process' "$1" "$2"; then
        fail 75 "another package manager is at work (apt's lock is held)." "Wait until it is done, and start again."
    elif grep -qE 'Temporary failure resolving|Could not resolve|Could not connect|Failed to fetch|Unable to fetch' "$1" "$2"; then
        fail 75 "the package servers cannot be reached." "Check the network (and http_proxy), and start again."
    elif grep -qE 'No space left|enough free space' "$1"; then
        fail 75 "the disk is full." "Make room, and start again."
    fi
    tail -n 15 "$1" >&2
    fail 69 "apt-get could not install the packages; its last words are above." "By hand, as root: $3"
}

system_packages() {
    begin "system packages (OpenCV, clang, software Vulkan)"
    if ! have dpkg-query || ! have apt-get; then
        other_distribution
        return
    fi
    local missing
    missing_packages
    if ((${#missing[@]} == 0)); then
        echo "there"
        return
    fi
    printf 'missing\n'
    say "Perception is built against OpenCV through clang; recordings are rendered with software Vulkan."
    say "Installing with apt-get: ${missing[*]}"
    install_packages "${missing[@]}"
    missing_packages
    ((${#missing[@]} == 0)) || fail 69 "still missing after the installation: ${missing[*]}." \
        "Install them by hand, and start again."
    say "installed"
}

other_distribution() {
    local lacking=()
    opencv_by_pkg_config || lacking+=("OpenCV 4 with headers and opencv4.pc")
    have clang || lacking+=(clang)
    have_libclang || lacking+=(libclang)
    have c++ || lacking+=("a C++ compiler")
    find_python || lacking+=("Python $PYTHON_MIN or later with venv")
    ((${#lacking[@]} == 0)) || fail 69 "this is neither Debian nor Ubuntu, and these are missing:" "${lacking[@]}" \
        "Install them with your system's package manager, and start again."
    echo "not Debian or Ubuntu, but all there"
}

# --- Python ----------------------------------------------------------------------------------------------------------

# find_python: sets `python` to an interpreter that is new enough and can make environments.
find_python() {
    local check="import sys, venv, ensurepip; sys.exit(sys.version_info < (${PYTHON_MIN/./, }))"
    # A finished environment speaks for itself: starting interpreters costs a quarter of a second.
    environment_is_current && return
    for python in python3 python3.14 python3.13 python3.12 python3.11 /usr/bin/python3; do
        have "$python" && "$python" -c "$check" >/dev/null 2>&1 && return
    done
    return 1
}

environment_is_current() {
    [[ -x $venv/bin/python && -x $venv/bin/rerun ]] && cmp -s "$root/deploy/requirements.txt" "$venv/installed.txt"
}

python_environment() {
    begin "Python environment (ONNX Runtime, rerun viewer, test peers)"
    if environment_is_current; then
        echo "there"
        return
    fi
    local python
    find_python || fail 69 "Python $PYTHON_MIN or later with the venv module was not found (python3 is $(python3 --version 2>&1))." \
        "Debian, Ubuntu: apt-get install python3 python3-venv"
    printf 'missing\n'
    say "Making .venv with $("$python" --version), from deploy/requirements.txt (0.3 GB to fetch, 0.9 GB on disk)."
    "$python" -m venv --clear "$venv" || fail 69 "the Python environment could not be made in $venv."
    local log
    log=$(mktemp)
    if ! "$venv/bin/python" -m pip install --disable-pip-version-check --no-input --only-binary :all: --no-deps \
        --progress-bar off -r "$root/deploy/requirements.txt" 2>&1 |
        tee "$log" | sed -u -n 's/^ *\(Downloading .*\)/      \1/p'; then
        explain_pip "$log"
    fi
    rm -f "$log"
    # Written last: an interrupted installation is done again.
    cp "$root/deploy/requirements.txt" "$venv/installed.txt"
    say "installed"
}

explain_pip() {
    if grep -qE 'No space left' "$1"; then
        fail 75 "the disk is full." "Make room, and start again."
    elif grep -qE 'NewConnectionError|NameResolution|Name or service|name resolution|unreachable|ReadTimeout|ConnectTimeout|ProxyError' "$1"; then
        fail 75 "the Python package index cannot be reached." "Check the network (and https_proxy), and start again."
    elif grep -qE 'CERTIFICATE_VERIFY_FAILED|SSLError' "$1"; then
        fail 69 "the Python package index's certificate is not trusted here." \
            "Behind a proxy that signs for others, name its certificates: export PIP_CERT=FILE"
    fi
    tail -n 15 "$1" >&2
    fail 69 "pip could not install deploy/requirements.txt; its last words are above." \
        "Packages for this processor and Python version may not exist: x86_64 and aarch64 with Python 3.11 to 3.14 are known to."
}

# --- environment and build -------------------------------------------------------------------------------------------

# Where OpenCV is. .cargo/config.toml holds Debian's split packages on x86_64; variables set here take precedence over it.
export_opencv() {
    if opencv_by_pkg_config; then
        # A lone plus adds nothing to what the opencv crate finds itself; an empty value would leave it without libraries.
        export OPENCV_LINK_LIBS=+ OPENCV_LINK_PATHS=+ OPENCV_INCLUDE_PATHS=+ OPENCV_DISABLE_PROBES=environment
    elif [[ $(uname -m) != x86_64 ]]; then
        local triplet
        triplet=$(cc -print-multiarch 2>/dev/null || true)
        triplet=${triplet:-$(uname -m)-linux-gnu}
        export OPENCV_LINK_PATHS=/usr/lib/$triplet
        export OPENCV_INCLUDE_PATHS=/usr/include/opencv4,/usr/include/$triplet/opencv4
    fi
}

export_environment() {
    export_opencv
    export PATH=$venv/bin:$PATH
    local libraries=("$venv"/lib/python3.*/site-packages/onnxruntime/capi/libonnxruntime.so.*)
    export ORT_DYLIB_PATH=${ORT_DYLIB_PATH:-${libraries[0]}}
    if [[ -z ${HOMING_DATA:-} && -d $root/../shared/data ]]; then
        HOMING_DATA=$(cd "$root/../shared/data" && pwd)
        export HOMING_DATA
    fi
}

# set_up: steps 1 and 2. Two of these at once would fight over .venv: the second waits.
set_up() {
    require_cargo
    require_disk
    exec 9<"$root/deploy"
    if ! flock -n 9; then
        say "another demo or test is installing here; waiting for it."
        flock 9
    fi
    system_packages
    python_environment
    exec 9<&-
    export_environment
}

# ONE selection and ONE profile for demo, tests and CI: another would compile hundreds of crates again.
build() {
    local from=$SECONDS
    begin "build"
    if [[ -x $CARGO_TARGET_DIR/debug/homing ]]; then
        echo
    else
        echo "for the first time: some 600 crates, about a quarter of an hour on two cores"
    fi
    (cd "$root" && cargo build --workspace --locked) || fail $? "the build failed; cargo's message is above." \
        "If it could not fetch crates, check the network and start again."
    say "$((SECONDS - from)) s"
}
