// What unflex in WebAssembly asks of its host: WASI preview 1, as far as it is used, and the module
// "unflex", by which exceptions are caught. Files and streams are whatever the caller gives:
//
//   files    open(name, how), stat(name, follow), list(name), makeFolder(name), removeFolder(name),
//            remove(name), rename(from, to), link(name). How: {create, exclusive, truncate, folder,
//            write}. An opened file has read(bytes, place), write(bytes, place), resize(length),
//            stat(), sync(), close(). A state is {type: 'file' | 'folder' | 'link', size, number,
//            device, written_ns}. They throw FileError.
//   streams  of the descriptors 0, 1 and 2: read(bytes) or write(bytes), isTerminal
//
// Numbers of bytes are plain numbers, times BigInts.
'use strict';

const errorNumbers = {
  EACCES: 2, EBADF: 8, EBUSY: 10, EEXIST: 20, EFBIG: 22, EINVAL: 28, EIO: 29, EISDIR: 31, ELOOP: 32,
  EMFILE: 33, ENAMETOOLONG: 37, ENOENT: 44, ENOSPC: 51, ENOSYS: 52, ENOTDIR: 54, ENOTEMPTY: 55,
  EPERM: 63, EPIPE: 64, EROFS: 69, ESPIPE: 70, EXDEV: 75,
};

class FileError extends Error {
  constructor(code) {
    super(code);
    this.code = code;
  }
}

class Exit extends Error {
  constructor(code) {
    super('the program ended');
    this.exitCode = code;
  }
}

// What the program throws; its own memory has the exception.
class Thrown extends Error {}

const fileTypes = { terminal: 2, folder: 3, file: 4, link: 7 };
const rightsOfAll = 0x1fffffffn;
const rightToSeek = 0x24n;

function makeHost({ args, environment, folders, files, streams }) {
  let memory;
  let program;
  const encoder = new TextEncoder();
  const decoder = new TextDecoder();
  const view = () => new DataView(memory.buffer);
  const bytes = (place, count) => new Uint8Array(memory.buffer, place, count);
  const text = (place, count) => decoder.decode(bytes(place, count).slice());

  // Descriptors. A folder of `folders` is known to the program by its name there.
  const open = streams.map((stream) => ({ stream }));
  for (const [name, path] of Object.entries(folders)) {
    open.push({ folder: path, name: encoder.encode(name) });
  }
  const at = (number) => {
    if (!open[number]) throw new FileError('EBADF');
    return open[number];
  };
  const fileAt = (number) => {
    const entry = at(number);
    if (!entry.file) throw new FileError(entry.stream ? 'ESPIPE' : 'EISDIR');
    return entry;
  };
  const pathOf = (number, place, count) => {
    const name = text(place, count);
    const folder = at(number).folder;
    if (folder === undefined) throw new FileError('ENOTDIR');
    return files.join(folder, name);
  };
  const add = (entry) => {
    let number = open.indexOf(undefined, 3);
    if (number < 0) number = open.length;
    open[number] = entry;
    return number;
  };

  const writeState = (place, state) => {
    const data = view();
    bytes(place, 64).fill(0);
    data.setBigUint64(place, BigInt(state.device ?? 0), true);
    data.setBigUint64(place + 8, BigInt(state.number ?? 0), true);
    data.setUint8(place + 16, fileTypes[state.type] ?? 0);
    data.setBigUint64(place + 24, 1n, true);
    data.setBigUint64(place + 32, BigInt(state.size ?? 0), true);
    for (const time of [40, 48, 56]) {
      data.setBigUint64(place + time, BigInt(state.written_ns ?? 0n), true);
    }
  };
  const stateOf = (entry) => {
    if (entry.stream) return { type: entry.stream.isTerminal ? 'terminal' : '' };
    return entry.file ? entry.file.stat() : files.stat(entry.folder, true);
  };
  // Calls `use` for each piece of memory of a list until it takes less than all of one.
  const forEachPiece = (list, count, total, use) => {
    let sum = 0;
    for (let i = 0; i < count; ++i) {
      const data = view();
      const length = data.getUint32(list + 8 * i + 4, true);
      const taken = use(bytes(data.getUint32(list + 8 * i, true), length), sum);
      sum += taken;
      if (taken < length) break;
    }
    view().setUint32(total, sum, true);
  };

  const putStrings = (strings, places, place) => {
    for (const string of strings) {
      view().setUint32(places, place, true);
      bytes(place, string.length).set(string);
      places += 4;
      place += string.length;
    }
  };
  const words = args.map((word) => encoder.encode(word + '\0'));
  const variables = Object.entries(environment).map(([name, value]) => encoder.encode(`${name}=${value}\0`));
  const putSizes = (strings, count, size) => {
    view().setUint32(count, strings.length, true);
    view().setUint32(size, strings.reduce((sum, string) => sum + string.length, 0), true);
  };

  const calls = {
    args_sizes_get: (count, size) => putSizes(words, count, size),
    args_get: (places, place) => putStrings(words, places, place),
    environ_sizes_get: (count, size) => putSizes(variables, count, size),
    environ_get: (places, place) => putStrings(variables, places, place),
    clock_res_get: (clock, place) => view().setBigUint64(place, 1000n, true),
    clock_time_get(clock, precision, place) {
      const now_ms = clock === 0 ? Date.now() : performance.now();
      view().setBigUint64(place, BigInt(Math.round(now_ms * 1e6)), true);
    },
    random_get(place, count) {
      globalThis.crypto.getRandomValues(bytes(place, count));
    },
    proc_exit(code) {
      throw new Exit(code);
    },
    sched_yield() {},

    fd_prestat_get(number, place) {
      const entry = at(number);
      if (!entry.name) throw new FileError('EBADF');
      view().setUint32(place, 0, true);
      view().setUint32(place + 4, entry.name.length, true);
    },
    fd_prestat_dir_name(number, place, count) {
      bytes(place, count).set(at(number).name.subarray(0, count));
    },
    fd_fdstat_get(number, place) {
      const entry = at(number);
      bytes(place, 24).fill(0);
      view().setUint8(place, fileTypes[stateOf(entry).type] ?? 0);
      const rights = entry.stream ? rightsOfAll & ~rightToSeek : rightsOfAll;
      view().setBigUint64(place + 8, rights, true);
      view().setBigUint64(place + 16, rights, true);
    },
    fd_fdstat_set_flags() {},
    fd_close(number) {
      const entry = at(number);
      open[number] = undefined;
      if (entry.file) entry.file.close();
    },
    fd_filestat_get: (number, place) => writeState(place, stateOf(at(number))),
    fd_filestat_set_size: (number, size) => fileAt(number).file.resize(Number(size)),
    fd_sync: (number) => fileAt(number).file.sync(),
    fd_datasync: (number) => fileAt(number).file.sync(),
    fd_seek(number, offset, from, place) {
      const entry = fileAt(number);
      const base = from === 0 ? 0 : from === 1 ? entry.place : entry.file.stat().size;
      const wanted = base + Number(offset);
      if (wanted < 0) throw new FileError('EINVAL');
      entry.place = wanted;
      view().setBigUint64(place, BigInt(wanted), true);
    },
    fd_tell: (number, place) => view().setBigUint64(place, BigInt(fileAt(number).place), true),
    fd_read(number, list, count, total) {
      const entry = at(number);
      if (entry.stream) {
        forEachPiece(list, count, total, (piece) => entry.stream.read(piece));
        return;
      }
      forEachPiece(list, count, total, (piece) => {
        const taken = fileAt(number).file.read(piece, entry.place);
        entry.place += taken;
        return taken;
      });
    },
    fd_pread(number, list, count, place, total) {
      const { file } = fileAt(number);
      forEachPiece(list, count, total, (piece, sum) => file.read(piece, Number(place) + sum));
    },
    fd_write(number, list, count, total) {
      const entry = at(number);
      if (entry.stream) {
        forEachPiece(list, count, total, (piece) => {
          entry.stream.write(piece);
          return piece.length;
        });
        return;
      }
      fileAt(number);
      if (entry.appends) entry.place = entry.file.stat().size;
      forEachPiece(list, count, total, (piece) => {
        const taken = entry.file.write(piece, entry.place);
        entry.place += taken;
        return taken;
      });
    },
    fd_readdir(number, place, room, cookie, used) {
      const entry = at(number);
      if (cookie === 0n || !entry.listed) entry.listed = files.list(entry.folder);
      let end = 0;
      for (let i = Number(cookie); i < entry.listed.length && end < room; ++i) {
        const name = encoder.encode(entry.listed[i].name);
        const record = new Uint8Array(24 + name.length);
        const data = new DataView(record.buffer);
        data.setBigUint64(0, BigInt(i + 1), true);
        data.setUint32(16, name.length, true);
        data.setUint8(20, fileTypes[entry.listed[i].type] ?? 0);
        record.set(name, 24);
        const fits = Math.min(record.length, room - end);
        bytes(place + end, fits).set(record.subarray(0, fits));
        end += fits;
      }
      view().setUint32(used, end, true);
    },

    path_open(number, lookup, place, count, how, rights, inherited, flags, result) {
      const name = pathOf(number, place, count);
      const wants = {
        create: (how & 1) !== 0,
        folder: (how & 2) !== 0,
        exclusive: (how & 4) !== 0,
        truncate: (how & 8) !== 0,
        write: (rights & 0x40n) !== 0n,
      };
      const isFolder = wants.folder || (!wants.create && files.stat(name, true).type === 'folder');
      if (isFolder && files.stat(name, true).type !== 'folder') throw new FileError('ENOTDIR');
      const entry = isFolder
        ? { folder: name }
        : { file: files.open(name, wants), place: 0, appends: (flags & 1) !== 0 };
      view().setUint32(result, add(entry), true);
    },
    path_filestat_get: (number, lookup, place, count, result) =>
      writeState(result, files.stat(pathOf(number, place, count), (lookup & 1) !== 0)),
    path_create_directory: (number, place, count) => files.makeFolder(pathOf(number, place, count)),
    path_remove_directory: (number, place, count) => files.removeFolder(pathOf(number, place, count)),
    path_unlink_file: (number, place, count) => files.remove(pathOf(number, place, count)),
    path_rename: (number, place, count, to, toPlace, toCount) =>
      files.rename(pathOf(number, place, count), pathOf(to, toPlace, toCount)),
    path_readlink(number, place, count, to, room, used) {
      const target = encoder.encode(files.link(pathOf(number, place, count))).subarray(0, room);
      bytes(to, target.length).set(target);
      view().setUint32(used, target.length, true);
    },
  };

  const wasi = {};
  for (const [name, call] of Object.entries(calls)) {
    wasi[name] = (...given) => {
      try {
        call(...given);
        return 0;
      } catch (error) {
        if (error instanceof Exit || !(error.code in errorNumbers)) throw error;
        return errorNumbers[error.code];
      }
    };
  }

  const catching = {
    call_catching(place, argument) {
      const stack = program.__stack_pointer.value;
      try {
        program.__indirect_function_table.get(place)(argument);
        return 0;
      } catch (error) {
        if (!(error instanceof Thrown)) throw error;
        program.__stack_pointer.value = stack;
        return 1;
      }
    },
    throw_here() {
      throw new Thrown('an exception that nobody caught');
    },
  };

  // Runs a compiled module to its end and returns its exit code.
  const run = (module) => {
    for (const { module: from, name } of WebAssembly.Module.imports(module)) {
      if (from === 'wasi_snapshot_preview1' && !wasi[name]) {
        wasi[name] = () => errorNumbers.ENOSYS;
      }
    }
    const instance = new WebAssembly.Instance(module, { wasi_snapshot_preview1: wasi, unflex: catching });
    program = instance.exports;
    memory = program.memory;
    try {
      program._start();
      return 0;
    } catch (error) {
      if (error instanceof Exit) return error.exitCode;
      throw error;
    } finally {
      for (const entry of open) {
        if (entry && entry.file) entry.file.close();
      }
    }
  };
  return { run };
}

if (typeof module === 'object') module.exports = { makeHost, FileError };
