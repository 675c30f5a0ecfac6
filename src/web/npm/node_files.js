// Files and streams of node, as wasi.js wants them.
'use strict';

const fs = require('node:fs');
const path = require('node:path');

const stateOf = (found) => ({
  type: found.isFile() ? 'file' : found.isDirectory() ? 'folder' : found.isSymbolicLink() ? 'link' : '',
  size: Number(found.size),
  number: found.ino,
  device: found.dev,
  written_ns: found.mtimeNs,
});

class NodeFile {
  constructor(number) {
    this.number = number;
  }
  read(bytes, place) {
    return fs.readSync(this.number, bytes, 0, bytes.length, this.isSeekable() ? place : null);
  }
  write(bytes, place) {
    return fs.writeSync(this.number, bytes, 0, bytes.length, this.isSeekable() ? place : null);
  }
  // Pipes and devices are read and written where they are.
  isSeekable() {
    this.seekable ??= fs.fstatSync(this.number).isFile();
    return this.seekable;
  }
  resize(length) {
    fs.ftruncateSync(this.number, length);
  }
  stat() {
    return stateOf(fs.fstatSync(this.number, { bigint: true }));
  }
  sync() {
    fs.fsyncSync(this.number);
  }
  close() {
    fs.closeSync(this.number);
  }
}

const { constants } = fs;

// How the program calls a folder: Windows' drives lie in its root, "/C:/Users".
const place = (folder) => (path.sep === '\\' ? `/${folder.replaceAll('\\', '/')}` : folder);
// A name of Windows that begins with a drive counts for itself, whatever the program has put before it.
const nameInPlace = (folder, name) =>
  path.resolve(folder, path.sep === '\\' ? name.replace(/^.*(?=[A-Za-z]:[\\/])/, '') : name);

// noteMade and noteGone are told the names of files that are made to be renamed or removed soon.
function makeNodeFiles({ noteMade, noteGone }) {
  return {
    join: nameInPlace,
    open(name, { create, exclusive, truncate, write }) {
      const flags = (write ? constants.O_RDWR : constants.O_RDONLY) |
        (create ? constants.O_CREAT : 0) | (exclusive ? constants.O_EXCL : 0) |
        (truncate ? constants.O_TRUNC : 0);
      let number;
      try {
        number = fs.openSync(name, flags, 0o666);
      } catch (error) {
        // A device may be only for writing.
        if (!write || error.code !== 'EACCES') throw error;
        number = fs.openSync(name, (flags & ~constants.O_RDWR) | constants.O_WRONLY, 0o666);
      }
      if (exclusive) noteMade(name);
      return new NodeFile(number);
    },
    stat: (name, follow) => stateOf((follow ? fs.statSync : fs.lstatSync)(name, { bigint: true })),
    list: (name) => fs.readdirSync(name, { withFileTypes: true }).map((entry) => ({
      name: entry.name,
      type: entry.isFile() ? 'file' : entry.isDirectory() ? 'folder' : entry.isSymbolicLink() ? 'link' : '',
    })),
    makeFolder: (name) => fs.mkdirSync(name),
    removeFolder: (name) => fs.rmdirSync(name),
    remove(name) {
      fs.unlinkSync(name);
      noteGone(name);
    },
    rename(from, to) {
      fs.renameSync(from, to);
      noteGone(from);
    },
    link: (name) => fs.readlinkSync(name),
  };
}

// A stream may be set not to block; then it is asked again.
function patiently(call) {
  for (;;) {
    try {
      return call();
    } catch (error) {
      if (error.code !== 'EAGAIN') throw error;
      Atomics.wait(new Int32Array(new SharedArrayBuffer(4)), 0, 0, 5);
    }
  }
}

function nodeStream(number) {
  return {
    isTerminal: require('node:tty').isatty(number),
    read(bytes) {
      try {
        return patiently(() => fs.readSync(number, bytes, 0, bytes.length, null));
      } catch (error) {
        if (error.code === 'EOF') return 0;
        throw error;
      }
    },
    write(bytes) {
      for (let done = 0; done < bytes.length;) {
        done += patiently(() => fs.writeSync(number, bytes, done, bytes.length - done, null));
      }
    },
  };
}

module.exports = { makeNodeFiles, nodeStream, place };
