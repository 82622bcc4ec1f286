# Sourced after cmake/packages.sh: WebGPU on a machine without a GPU. firn_webgpu fetches, once, into $root/build/webgpu
# Dawn (compiler Tint) for node, Deno (wgpu, compiler naga), and Chromium with the software Vulkan driver SwiftShader.
# No package runs a script of its own, and nothing of the system's graphics is used.
#   firn_dawn SCRIPT ARGUMENT...       node; the script finds Dawn through $FIRN_WEBGPU
#   firn_deno SCRIPT ARGUMENT...       Deno, which may read files and do nothing else
#   firn_chromium SCRIPT ARGUMENT...   node; the script finds playwright-core and chromium/ in $FIRN_WEBGPU
#   firn_swiftshader PROGRAM ARGUMENT...   any program, with SwiftShader as its Vulkan driver

# package            version  SHA-512 of the registry's archive
firn_webgpu_packages='
webgpu                0.6.2    dcbe067e6a892ef6142045899e011063ed87422525005920f3e3fc3430e3dd7c798471c814efebf095beca77ea063ee41cde266e7c0eef8b81fa5ad1b4b869e1
@deno/linux-x64-glibc 2.9.6    de67784ca2c2bb3b0b0e67cea02e4a37b34065ac525643209bae2f83a7e80f4d090400c2a584b6ff942a5dfce09cfe59433de22cff6f05026d120735d7a380a1
@sparticuz/chromium   153.0.0  8e2196a92bcf31dbb8f8ff538a562a011ef21063c41c8371fa50af13f36a34efc41d8cc5ff1d615222394fa8a8548b7b744cbb9fcf1bcb24f4be4f9d9ec810c0
playwright-core       1.60.0   f5b5bacef5ff9b49446e04ca27a629a4e2b1f07dd538f04c382161da2ad714e4f805b1e0af1e613e3c0960b4f8d0bbbee2ab43dfaa8a73f1e7e7a4ad516e7b20
'
# Dawn with WebGPU's C interface, and a header of the same revision: that they match is tested for these two only.
# package               version  SHA-512 of the registry's archive, and what is taken of it if not all
firn_webgpu_c_packages='
bun-webgpu-linux-x64    0.1.7    5043fb519744871f68b6f9197338ecb332fc65596b38300d42f825f82f3cfdb3559b10e8162ef0d5f5b31a2d6c6726a48844e39ad143ab6ff108b85b499c63ab
react-native-webgpu     0.10.2   951a01229a3db971b4ad148669ff57398dd2ca757961e3ebb09525cb2de3379c921c469591c42d17a2fbcc0fc5ae7db606058a399f8a9395ba368fb42aeb7afe cpp/webgpu/webgpu.h
'
firn_webgpu_folder=$root/build/webgpu
firn_node_major=18 # at least

# True if firn_dawn and firn_deno can be used; otherwise says in a sentence what is missing.
firn_webgpu() {
    if [[ $(uname -sm) != 'Linux x86_64' ]]; then
        echo "WebGPU without a GPU is set up on Linux x86-64 only, and this is $(uname -sm)." >&2
        return 1
    fi
    local name version sum missing=() wanted=(node)
    while read -r name version sum; do
        [[ -z $name || -e $(firn_webgpu_stamp "$name" "$version") ]] || missing+=("$name@$version")
    done <<<"$firn_webgpu_packages"
    if ((${#missing[@]})); then wanted+=(npm); fi
    firn_install_if_offered "${wanted[@]}" || true
    local major
    major=$(node -p 'process.versions.node.split(".")[0]' 2>/dev/null || echo 0)
    if ((major < firn_node_major)); then
        echo "WebGPU without a GPU needs node $firn_node_major or later; on Debian and Ubuntu: nodejs." >&2
        return 1
    fi
    if ((${#missing[@]})) && ! command -v npm >/dev/null; then
        echo "WebGPU without a GPU needs npm, to fetch ${missing[*]}." >&2
        return 1
    fi
    while read -r name version sum; do
        if [[ -n $name ]] && ! firn_webgpu_unpack "$name" "$version" "$sum" </dev/null; then
            echo "WebGPU without a GPU needs ${missing[*]}; $name@$version could not be had from the npm registry." >&2
            return 1
        fi
    done <<<"$firn_webgpu_packages"
    firn_brotli swiftshader.tar.br swiftshader
}

# True if firn::webgpu can be built against Dawn: FIRN_WEBGPU_HEADER_DIR and FIRN_WEBGPU_LIBRARY are set for CMake, to the
# user's if there are. Otherwise says in a sentence what is missing. To run it takes firn_webgpu and firn_swiftshader.
firn_webgpu_c() {
    [[ -z ${FIRN_WEBGPU_HEADER_DIR:-} || -z ${FIRN_WEBGPU_LIBRARY:-} ]] || return 0
    if [[ $(uname -sm) != 'Linux x86_64' ]]; then
        echo "WebGPU's C interface is fetched on Linux x86-64 only, and this is $(uname -sm)." >&2
        return 1
    fi
    local name version sum only
    while read -r name version sum only; do
        [[ -n $name && ! -e $(firn_webgpu_stamp "$name" "$version") ]] || continue
        firn_install_if_offered npm || true
        if ! firn_webgpu_unpack "$name" "$version" "$sum" ${only:+"$only"} </dev/null; then
            echo "WebGPU's C interface needs $name@$version, which could not be had from the npm registry." >&2
            return 1
        fi
    done <<<"$firn_webgpu_c_packages"
    FIRN_WEBGPU_HEADER_DIR=$firn_webgpu_folder/node_modules/react-native-webgpu/cpp
    FIRN_WEBGPU_LIBRARY=$firn_webgpu_folder/node_modules/bun-webgpu-linux-x64/libwebgpu_wrapper.so
}

firn_webgpu_stamp() { echo "$firn_webgpu_folder/node_modules/$1/.version-$2"; } # NAME VERSION

# NAME VERSION SHA512 PATH...: fetches with npm, which knows the user's registry, and unpacks what runs on this machine,
# or only the paths.
firn_webgpu_unpack() {
    local stamp folder archive
    stamp=$(firn_webgpu_stamp "$1" "$2")
    [[ ! -e $stamp ]] || return 0
    local name=$1 version=$2 sum=$3
    shift 3
    folder=$firn_webgpu_folder/fetched
    rm -rf "$folder"
    mkdir -p "$folder/package"
    echo "Fetching $name@$version"
    local options=(--silent --ignore-scripts --prefer-offline --fetch-retries=1)
    (cd "$folder" && npm pack "${options[@]}" "$name@$version") >/dev/null || return 1
    for archive in "$folder"/*.tgz; do
        if [[ $(sha512sum <"$archive") != "$sum  -" ]]; then
            echo "The archive of $name@$version is not the one that firn was tested with." >&2
            return 1
        fi
        tar -xzf "$archive" -C "$folder/package" --strip-components=1 --no-same-owner \
            --exclude='dist/win32-*' --exclude='dist/darwin-*' --exclude='dist/linux-arm64' "${@/#/package/}" || return 1
    done
    rm -rf "${stamp%/*}"
    mkdir -p "${stamp%/*}"
    mv "$folder/package"/* "${stamp%/*}/" && rm -rf "$folder" && touch "$stamp"
}

# FILE FOLDER: unpacks a brotli archive of Chromium's package, once.
firn_brotli() {
    local archive=$firn_webgpu_folder/node_modules/@sparticuz/chromium/bin/$1 folder=$firn_webgpu_folder/$2
    [[ ! -e $folder/.$1 ]] || return 0
    mkdir -p "$folder"
    # The tar archive, or the file itself, without an external brotli.
    node -e 'const fs = require("fs");
        fs.writeFileSync(process.argv[2], require("zlib").brotliDecompressSync(fs.readFileSync(process.argv[1])));' \
        "$archive" "$folder/archive" || return 1
    if [[ $1 == *.tar.br ]]; then
        tar -xf "$folder/archive" -C "$folder" --no-same-owner && rm "$folder/archive"
    else
        mv "$folder/archive" "$folder/$(basename "$1" .br)" && chmod +x "$folder/$(basename "$1" .br)"
    fi && touch "$folder/.$1"
}

firn_swiftshader() { # COMMAND...
    local folder=$firn_webgpu_folder/swiftshader
    env -u VK_DRIVER_FILES FIRN_WEBGPU="$firn_webgpu_folder" VK_ICD_FILENAMES="$folder/vk_swiftshader_icd.json" \
        LD_LIBRARY_PATH="$folder${LD_LIBRARY_PATH:+:$LD_LIBRARY_PATH}" "$@"
}

firn_dawn() { firn_swiftshader node "$@"; }

# Without DENO_WEBGPU_BACKEND wgpu silently takes OpenGL, where floats differ.
firn_deno() {
    local variables=(DENO_WEBGPU_BACKEND=vulkan DENO_DIR="$firn_webgpu_folder/deno" DENO_NO_UPDATE_CHECK=1 NO_COLOR=1)
    firn_swiftshader env "${variables[@]}" "$firn_webgpu_folder/node_modules/@deno/linux-x64-glibc/deno" run --quiet \
        --no-remote --no-npm --no-config --no-lock --no-prompt --unstable-webgpu --allow-read "$@"
}

# Chromium looks for SwiftShader beside itself; the package brings the libraries that a small system lacks.
firn_chromium() {
    local archive folder=$firn_webgpu_folder/chromium
    for archive in chromium.br swiftshader.tar.br fonts.tar.br al2023.tar.br; do
        firn_brotli "$archive" chromium || return 1
    done
    echo "<fontconfig><dir>$folder/fonts</dir><cachedir>$folder/cache</cachedir></fontconfig>" >"$folder/fonts.conf"
    FIRN_WEBGPU="$firn_webgpu_folder" node "$@"
}
