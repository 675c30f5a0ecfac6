// Decodes the print's paths from the report's bytes.
const codeToUm = code => (code === 0 ? 0 : 0.05 * 2 ** (code / 15));

const bytesOf = text => {
  const binary = atob(text);
  const bytes = new Uint8Array(binary.length);
  for (let i = 0; i < binary.length; ++i) bytes[i] = binary.charCodeAt(i);
  return bytes;
};

// Decodes a layer when it is first asked for: {x0, y0, x1, y1 (mm), before, after (codes), path
// (number in `heads`), heads [{feature, first, last}]}.
const layerReader = (bytes, rows) => {
  const read = new Array(rows.length);
  const decode = (from, to) => {
    let at = from;
    const number = () => {
      let value = 0,
        scale = 1,
        byte;
      do {
        byte = bytes[at++];
        value += (byte & 127) * scale;
        scale *= 128;
      } while (byte > 127);
      return value;
    };
    const signed = () => {
      const value = number();
      return value % 2 ? -(value + 1) / 2 : value / 2;
    };
    const most = (to - from) >> 2,
      heads = [];
    const places = new Float64Array(4 * most),
      codes = new Uint8Array(2 * most),
      path = new Int32Array(most);
    let x = 0,
      y = 0,
      line = 0,
      segments = 0;
    while (at < to) {
      const feature = number(),
        count = number();
      line += signed();
      heads.push({feature, first: line, last: line + number()});
      x += signed();
      y += signed();
      for (let i = 0; i < count; ++i, ++segments) {
        const place = 4 * segments;
        places[place] = x / 100;
        places[place + 1] = y / 100;
        x += signed();
        y += signed();
        places[place + 2] = x / 100;
        places[place + 3] = y / 100;
        codes[2 * segments] = bytes[at++];
        codes[2 * segments + 1] = bytes[at++];
        path[segments] = heads.length - 1;
      }
    }
    return {count: segments, places, codes, path, heads};
  };
  return index =>
    read[index] || (read[index] = decode(index ? rows[index - 1][2] : 0, rows[index][2]));
};
