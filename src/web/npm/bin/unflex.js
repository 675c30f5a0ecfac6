#!/usr/bin/env node
// The command line of unflex, by its WebAssembly. The program runs in a thread of its own, so that a
// signal is heard while it computes.
'use strict';

const fs = require('node:fs');
const os = require('node:os');
const path = require('node:path');
const { Worker, isMainThread, parentPort, workerData } = require('node:worker_threads');

const internalError = 4;

function compute() {
  // Older versions of node do not have it where browsers do.
  globalThis.crypto ??= require('node:crypto').webcrypto;
  const { makeHost } = require('../wasi.js');
  const { makeNodeFiles, nodeStream, place } = require('../node_files.js');
  const host = makeHost({
    args: ['unflex', ...workerData],
    environment: { ...process.env, PWD: place(process.cwd()), TMPDIR: place(os.tmpdir()) },
    folders: { '/': path.parse(process.cwd()).root },
    files: makeNodeFiles({
      noteMade: (made) => parentPort.postMessage({ made }),
      noteGone: (gone) => parentPort.postMessage({ gone }),
    }),
    streams: [nodeStream(0), nodeStream(1), nodeStream(2)],
  });
  const program = new WebAssembly.Module(fs.readFileSync(path.join(__dirname, '..', 'unflex.wasm')));
  try {
    return host.run(program);
  } catch (error) {
    const isMemory = error instanceof WebAssembly.RuntimeError || error instanceof RangeError;
    if (!isMemory && error.code !== 'EPIPE') throw error;
    if (isMemory) fs.writeSync(2, 'unflex: out of memory, or a fault of the program; end other programs\n');
    return internalError;
  }
}

if (!isMainThread) {
  parentPort.postMessage({ code: compute() });
} else {
  const unfinished = new Set();
  const worker = new Worker(__filename, { workerData: process.argv.slice(2) });
  worker.on('message', ({ made, gone, code }) => {
    if (made) unfinished.add(made);
    if (gone) unfinished.delete(gone);
    if (code !== undefined) process.exitCode = code;
  });
  worker.on('error', (error) => {
    fs.writeSync(2, `unflex: ${error.stack}\n`);
    process.exitCode = internalError;
  });
  for (const [signal, number] of Object.entries({ SIGINT: 2, SIGTERM: 15, SIGHUP: 1 })) {
    process.on(signal, async () => {
      await worker.terminate();
      for (const name of unfinished) fs.rmSync(name, { force: true });
      fs.writeSync(2, unfinished.size > 0 ? 'unflex: interrupted, no file was written\n' : 'unflex: interrupted\n');
      process.exit(128 + number);
    });
  }
}
