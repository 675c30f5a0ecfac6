// Files in the browser's memory, as wasi.js wants them. What was dropped onto the page is read in
// pieces where it lies (a Blob); what is written grows by pieces, so that nothing large is copied.
'use strict';

const pieceBytes = 1 << 20;

class MemoryFile {
  constructor(blob) {
    this.pieces = [];
    this.size = 0;
    this.written = BigInt(Date.now()) * 1000000n;
    if (blob) {
      this.blob = blob;
      this.size = blob.size;
    }
  }
  // A piece of a Blob is kept until another is asked for.
  pieceOfBlob(index) {
    if (this.read !== index) {
      const from = index * pieceBytes;
      this.piece = new Uint8Array(
        new FileReaderSync().readAsArrayBuffer(this.blob.slice(from, from + pieceBytes)));
      this.read = index;
    }
    return this.piece;
  }
  take(bytes, place) {
    let done = 0;
    while (done < bytes.length && place < this.size) {
      const index = Math.floor(place / pieceBytes);
      const from = place % pieceBytes;
      const piece = this.blob ? this.pieceOfBlob(index) : this.pieces[index];
      const count = Math.min(bytes.length - done, pieceBytes - from, this.size - place);
      bytes.set(piece.subarray(from, from + count), done);
      done += count;
      place += count;
    }
    return done;
  }
  put(bytes, place) {
    this.toPieces();
    this.grow(Math.max(this.size, place + bytes.length));
    for (let done = 0; done < bytes.length;) {
      const from = (place + done) % pieceBytes;
      const count = Math.min(bytes.length - done, pieceBytes - from);
      this.pieces[Math.floor((place + done) / pieceBytes)].set(bytes.subarray(done, done + count), from);
      done += count;
    }
    return bytes.length;
  }
  grow(size) {
    while (this.pieces.length * pieceBytes < size) this.pieces.push(new Uint8Array(pieceBytes));
    this.size = size;
  }
  resize(size) {
    this.toPieces();
    // What is cut off must not come back.
    for (let at = size; at < this.size;) {
      const from = at % pieceBytes;
      this.pieces[Math.floor(at / pieceBytes)].fill(0, from);
      at += pieceBytes - from;
    }
    this.grow(size);
    this.pieces.length = Math.ceil(size / pieceBytes);
  }
  toPieces() {
    if (!this.blob) return;
    const { blob, size } = this;
    const all = new Uint8Array(new FileReaderSync().readAsArrayBuffer(blob));
    this.blob = undefined;
    this.size = 0;
    this.put(all.subarray(0, size), 0);
  }
  toBlob(type) {
    if (this.blob) return this.blob;
    const whole = this.pieces.map((piece, i) =>
      piece.subarray(0, Math.min(pieceBytes, this.size - i * pieceBytes)));
    return new Blob(whole, { type });
  }
}

// contents: Blobs or strings by their names, which begin with '/'.
function makeMemoryFiles(contents) {
  const files = new Map();
  const folders = new Set(['/']);
  const numbers = new Map();

  const join = (folder, name) => {
    const parts = [];
    for (const part of (name.startsWith('/') ? name : `${folder}/${name}`).split('/')) {
      if (part === '..') parts.pop();
      else if (part && part !== '.') parts.push(part);
    }
    return `/${parts.join('/')}`;
  };
  const folderOf = (name) => name.slice(0, name.lastIndexOf('/')) || '/';
  const must = (found) => {
    if (!found) throw new FileError('ENOENT');
    return found;
  };
  const addFolders = (name) => {
    for (let at = name; !folders.has(at); at = folderOf(at)) folders.add(at);
  };
  for (const [name, content] of Object.entries(contents)) {
    addFolders(folderOf(name));
    files.set(name, new MemoryFile(content instanceof Blob ? content : new Blob([content])));
  }
  const numberOf = (item) => {
    if (!numbers.has(item)) numbers.set(item, numbers.size + 1);
    return numbers.get(item);
  };
  const stat = (name) => {
    if (folders.has(name)) return { type: 'folder', number: numberOf(name) };
    const file = must(files.get(name));
    return { type: 'file', size: file.size, number: numberOf(file), written_ns: file.written };
  };

  return {
    join,
    stat,
    open(name, { create, exclusive, truncate }) {
      let file = files.get(name);
      if (!file) {
        if (!create || !folders.has(folderOf(name))) throw new FileError('ENOENT');
        file = new MemoryFile();
        files.set(name, file);
      } else if (exclusive) {
        throw new FileError('EEXIST');
      }
      if (truncate) file.resize(0);
      return {
        read: (bytes, place) => file.take(bytes, place),
        write: (bytes, place) => file.put(bytes, place),
        resize: (size) => file.resize(size),
        stat: () => ({ type: 'file', size: file.size, number: numberOf(file), written_ns: file.written }),
        sync() {},
        close() {},
      };
    },
    list(name) {
      if (!folders.has(name)) throw new FileError('ENOENT');
      const below = name === '/' ? '/' : `${name}/`;
      const isIn = (other) => other !== name && other.startsWith(below) && !other.slice(below.length).includes('/');
      return [...folders].filter(isIn).map((other) => ({ name: other.slice(below.length), type: 'folder' }))
        .concat([...files.keys()].filter(isIn).map((other) => ({ name: other.slice(below.length), type: 'file' })));
    },
    makeFolder(name) {
      if (folders.has(name) || files.has(name)) throw new FileError('EEXIST');
      folders.add(name);
    },
    removeFolder: (name) => must(folders.delete(name)),
    remove: (name) => must(files.delete(name)),
    rename(from, to) {
      files.set(to, must(files.get(from)));
      files.delete(from);
    },
    link() {
      throw new FileError('EINVAL');
    },
    blob: (name) => files.get(name)?.toBlob(),
  };
}
