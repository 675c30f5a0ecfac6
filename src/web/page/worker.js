// Runs the command line of unflex once, in a thread of its own:
// {module, args, files: {name: Blob or text}, wanted: [name]} in; {stage, share, left} while it
// works; {code, told, said: [line], files: {name: Blob}} in the end, or {fault}.
'use strict';

function makeStreams(onProgress) {
  const decoder = new TextDecoder();
  let told = '';
  let said = '';
  // The bar for a terminal: "stage [###---] 40 %, 2 min left".
  const bar = /\r\x1b\[K([^[\r\n]*?)(?: \[[#-]*\])? +(\d+) %(?:, ([^\r\n\x1b]*))?/g;
  return {
    streams: [
      { read: () => 0 },
      { write: (bytes) => { told += decoder.decode(bytes.slice(), { stream: true }); } },
      {
        isTerminal: true,
        write(bytes) {
          const text = new TextDecoder().decode(bytes.slice());
          const last = [...text.matchAll(bar)].pop();
          if (last) onProgress({ stage: last[1].trim(), share: Number(last[2]) / 100, left: last[3] ?? '' });
          if (!text.startsWith('\r')) said += text;
        },
      },
    ],
    told: () => told,
    said: () => said.split('\n').filter((line) => line),
  };
}

onmessage = ({ data: { module, args, files, wanted } }) => {
  try {
    const memory = makeMemoryFiles({ '/tmp/.keep': '', ...files });
    const streams = makeStreams((progress) => postMessage(progress));
    const host = makeHost({
      args: ['unflex', ...args],
      environment: { PWD: '/', TERM: 'xterm', NO_COLOR: '1', TMPDIR: '/tmp' },
      folders: { '/': '/' },
      files: memory,
      streams: streams.streams,
    });
    const code = host.run(module);
    const made = {};
    for (const name of wanted) {
      const blob = memory.blob(name);
      if (blob) made[name] = blob;
    }
    postMessage({ code, told: streams.told(), said: streams.said(), files: made });
  } catch (error) {
    const isMemory = error instanceof RangeError || error instanceof WebAssembly.RuntimeError;
    postMessage({ fault: isMemory ? 'The browser has no more memory for this, or unflex has a fault.' : String(error) });
  }
};
