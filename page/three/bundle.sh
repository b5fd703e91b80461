#!/bin/sh
# Make ../three_bundle.js from three.js: needs npm and a network. Neither the build nor the page needs them: the bundle
# lies in the tree. To be run when package.json or three_parts.js changes.
set -e
cd "$(dirname "$0")"
npm ci --no-audit --no-fund
npx esbuild three_parts.js --bundle --minify --format=iife --global-name=THREE --legal-comments=none --target=es2020 \
    --outfile=bundle.tmp.js
{
    echo "/* three.js $(node -p "JSON.parse(fs.readFileSync('node_modules/three/package.json')).version"), parts of it, by page/three/bundle.sh. MIT:"
    cat node_modules/three/LICENSE
    echo "*/"
    cat bundle.tmp.js
} > ../three_bundle.js
rm -rf bundle.tmp.js node_modules
