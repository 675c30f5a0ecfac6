#!/usr/bin/env node
// The command line of unflex, by its WebAssembly.
'use strict';

const fs = require('node:fs');
const os = require('node:os');
const path = require('node:path');
// Older versions of node do not have it where browsers do.
globalThis.crypto ??= require('node:crypto').webcrypto;

const { makeHost } = require('../wasi.js');
const { nodeFiles, nodeStream } = require('../node_files.js');

const host = makeHost({
  args: ['unflex', ...process.argv.slice(2)],
  environment: { ...process.env, TMPDIR: os.tmpdir() },
  folders: { '.': process.cwd(), '/': path.parse(process.cwd()).root },
  files: nodeFiles,
  streams: [nodeStream(0), nodeStream(1), nodeStream(2)],
});
const program = new WebAssembly.Module(fs.readFileSync(path.join(__dirname, '..', 'unflex.wasm')));
try {
  process.exitCode = host.run(program);
} catch (error) {
  if (!(error instanceof WebAssembly.RuntimeError || error instanceof RangeError)) throw error;
  fs.writeSync(2, 'unflex: out of memory, or a fault of the program; end other programs\n');
  process.exitCode = 4;
}
