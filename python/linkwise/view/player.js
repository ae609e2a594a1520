// Plays an exported view: in the place of the server and of live.py, within the page.
//
// viser's client starts a worker that holds the connection to a server. Here it gets a stand-in
// whose messages come from the page itself. The functions in `place` make what the classes of
// placement.py make, kind by kind.
"use strict";
(() => {
  const NOTHING = 1e-9; // of a size: three.js cannot invert a transform of scale 0
  const MOST_PLOTTED = 500, PLOT_INTERVAL = 100; // [ms]
  const SPEEDS = {"1/100": 0.01, "1/10": 0.1, "1/4": 0.25, "1/2": 0.5};
  const TYPES = {"<f4": Float32Array, "<f8": Float64Array, "|u1": Uint8Array, "<u2": Uint16Array,
    "<u4": Uint32Array, "|i1": Int8Array, "<i2": Int16Array, "<i4": Int32Array};

  async function read() {
    const packed = document.getElementById("linkwise-data").textContent;
    const zipped = await fetch(`data:application/octet-stream;base64,${packed}`);
    const plain = zipped.body.pipeThrough(new DecompressionStream("gzip"));
    const buffer = await new Response(plain).arrayBuffer();
    const size = Number(new DataView(buffer).getBigUint64(0, true));
    const text = new TextDecoder().decode(new Uint8Array(buffer, 8, size));
    const {content, lengths} = JSON.parse(text);
    let at = 8 + size;
    const offsets = lengths.map(length => {
      const from = at + (8 - at % 8) % 8;
      at = from + length;
      return from;
    });
    const filled = value => {
      if (value === null || typeof value !== "object") return value;
      const k = value.__binary_index;
      if (k !== undefined) {
        const type = TYPES[value.dtype];
        return new type(buffer, offsets[k], lengths[k] / type.BYTES_PER_ELEMENT);
      }
      for (const key of Object.keys(value)) value[key] = filled(value[key]);
      return value;
    };
    return filled(content);
  }

  // -- numbers -------------------------------------------------------------------------------

  // As Python writes them with ".4g".
  function general(x) {
    if (x === 0 || !Number.isFinite(x)) return String(x);
    const [digits, power] = x.toExponential(3).split("e");
    if (power >= -4 && power < 4) return String(Number(x.toPrecision(4)));
    return `${Number(digits)}e${power[0]}${power.slice(1).padStart(2, "0")}`;
  }

  // Writes out[4k..] = a * b, quaternions with their scalar first.
  function product(out, k, aw, ax, ay, az, bw, bx, by, bz) {
    out[4 * k] = aw * bw - ax * bx - ay * by - az * bz;
    out[4 * k + 1] = aw * bx + ax * bw + ay * bz - az * by;
    out[4 * k + 2] = aw * by - ax * bz + ay * bw + az * bx;
    out[4 * k + 3] = aw * bz + ax * by - ay * bx + az * bw;
  }

  const turned = [0, 0, 0];
  function turn(w, x, y, z, a, b, c) {
    const tx = 2 * (y * c - z * b), ty = 2 * (z * a - x * c), tz = 2 * (x * b - y * a);
    turned[0] = a + w * tx + y * tz - z * ty;
    turned[1] = b + w * ty + z * tx - x * tz;
    turned[2] = c + w * tz + x * ty - y * tx;
    return turned;
  }

  // Writes the quaternion that turns z into the unit vector (x, y, z) by the shortest way.
  function turnZTo(out, k, x, y, z) {
    if (z < -1 + 1e-9) {
      out.set([0, 1, 0, 0], 4 * k);
      return;
    }
    const size = Math.hypot(1 + z, x, y);
    out.set([(1 + z) / size, -y / size, x / size, 0], 4 * k);
  }

  // -- pictures ------------------------------------------------------------------------------

  const place = {
    fixed: () => ({}),

    following({poses: frames}, layer) {
      const n = layer.links.length, at = layer.positions, q = layer.wxyzs;
      const positions = new Float32Array(3 * n), wxyzs = new Float32Array(4 * n);
      for (let k = 0; k < n; k++) {
        const f = 7 * layer.links[k];
        const [w, x, y, z] = [frames[f + 3], frames[f + 4], frames[f + 5], frames[f + 6]];
        const moved = turn(w, x, y, z, at[3 * k], at[3 * k + 1], at[3 * k + 2]);
        for (let c = 0; c < 3; c++) positions[3 * k + c] = frames[f + c] + moved[c];
        product(wxyzs, k, w, x, y, z, q[4 * k], q[4 * k + 1], q[4 * k + 2], q[4 * k + 3]);
      }
      return {batched_positions: positions, batched_wxyzs: wxyzs};
    },

    spanning({poses: joints}, layer) {
      const n = layer.outboard.length;
      const positions = new Float32Array(3 * n), wxyzs = new Float32Array(4 * n);
      const scales = new Float32Array(3 * n);
      for (let k = 0; k < n; k++) {
        const a = 7 * layer.inboard[k], b = 7 * layer.outboard[k];
        const [x, y, z] = [0, 1, 2].map(c => joints[b + c] - joints[a + c]);
        for (let c = 0; c < 3; c++) positions[3 * k + c] = (joints[a + c] + joints[b + c]) / 2;
        const length = Math.hypot(x, y, z);
        if (length > 0) turnZTo(wxyzs, k, x / length, y / length, z / length);
        else turnZTo(wxyzs, k, 0, 0, 1);
        scales.set([layer.radius, layer.radius, Math.max(length, NOTHING)], 3 * k);
      }
      return {batched_positions: positions, batched_wxyzs: wxyzs, batched_scales: scales};
    },

    lines({poses: joints}, layer) {
      const points = new Float32Array(6 * layer.outboard.length);
      layer.outboard.forEach((outboard, k) => {
        for (let c = 0; c < 3; c++) {
          points[6 * k + c] = joints[7 * layer.inboard[k] + c];
          points[6 * k + 3 + c] = joints[7 * outboard + c];
        }
      });
      return {points};
    },

    marks: ({points}) => ({batched_positions: points}),

    bending({beams}, layer, style) {
      const n = layer.pieces.length;
      const positions = new Float32Array(3 * n), wxyzs = new Float32Array(4 * n);
      const scales = new Float32Array(3 * n), colors = new Uint8Array(3 * n);
      for (let k = 0; k < n; k++) {
        const piece = beams.subarray(9 * layer.pieces[k], 9 * layer.pieces[k] + 9);
        positions.set(piece.subarray(0, 3), 3 * k);
        wxyzs.set(piece.subarray(3, 7), 4 * k);
        scales.set([layer.sizes[2 * k], layer.sizes[2 * k + 1], Math.max(piece[7], NOTHING)], 3 * k);
        mix(colors, k, style.colors.size, style.bending > 0 ? piece[8] / style.bending : 0);
      }
      return {batched_positions: positions, batched_wxyzs: wxyzs, batched_scales: scales,
        batched_colors: colors};
    },

    loads(moment, layer, style) {
      const {poses, loads, known} = moment, {half, joints} = layer, n = joints.length;
      const points = new Float32Array(3 * n);
      const wxyzs = new Float32Array(4 * n), scales = new Float32Array(n);
      const colors = new Uint8Array(3 * n);
      const largest = style.largest[half];
      const uses = style.byRating ? ratingUse(loads, half, style.rating) : null;
      for (let k = 0; k < n; k++) {
        const joint = joints[k];
        const [a, b, c] = [0, 1, 2].map(i => loads[6 * joint + 3 * half + i]);
        const size = Number.isFinite(a + b + c) ? Math.hypot(a, b, c) : 0;
        const share = largest > 0 ? size / largest : 0;
        for (let i = 0; i < 3; i++) points[3 * k + i] = poses[7 * joint + i];
        if (size > 0) {
          const q = 7 * joint + 3;
          const [x, y, z] = turn(poses[q], poses[q + 1], poses[q + 2], poses[q + 3],
            a / size, b / size, c / size);
          turnZTo(wxyzs, k, x, y, z);
        } else {
          turnZTo(wxyzs, k, 0, 0, 1);
        }
        const shown = !known || known[2 * joint + half] === layer.known;
        scales[k] = style.longest * (shown ? Math.max(share, NOTHING) : NOTHING);
        if (!uses) mix(colors, k, style.colors.size, share);
        else if (Number.isNaN(uses[joint])) colors.set(style.colors.unrated, 3 * k);
        else if (uses[joint] > 1) colors.set(style.colors.overloaded, 3 * k);
        else mix(colors, k, style.colors.use, uses[joint]);
      }
      return {batched_positions: points, batched_wxyzs: wxyzs, batched_scales: scales,
        batched_colors: colors};
    },
  };

  function mix(out, k, stops, share) {
    const at = Math.min(share, 1) * (stops.length - 1);
    const low = Math.min(Math.floor(at), stops.length - 2);
    for (let c = 0; c < 3; c++) {
      out[3 * k + c] = Math.round(stops[low][c] + (at - low) * (stops[low + 1][c] - stops[low][c]));
    }
  }

  // The largest share of a rating that each joint's force (half 0) or moment (1) uses.
  function ratingUse(loads, half, {directions, limits}) {
    const names = half ? ["moment", "tilting_moment", "torque"] : ["force", "axial", "radial"];
    const [whole, across, along] = half ? names : [names[0], names[2], names[1]];
    const uses = new Float64Array(loads.length / 6);
    for (let k = 0; k < uses.length; k++) {
      const [a, b, c] = [0, 1, 2].map(i => loads[6 * k + 3 * half + i]);
      const [x, y, z] = [0, 1, 2].map(i => directions[3 * k + i]);
      const axial = a * x + b * y + c * z;
      const sizes = {[whole]: Math.hypot(a, b, c), [along]: Math.abs(axial),
        [across]: Math.hypot(a - axial * x, b - axial * y, c - axial * z)};
      uses[k] = names.reduce((most, name) => {
        const use = sizes[name] / limits[name][k];
        return Number.isNaN(use) || use < most ? most : use;
      }, NaN);
    }
    return uses;
  }

  // -- player --------------------------------------------------------------------------------

  class Player {
    constructor(data, post) {
      this.data = data;
      this.post = post;
      this.n = data.jointNames.length;
      this.parts = data.loads.length / (6 * this.n * data.times.length) || 0;
      this.start = data.times[0];
      this.end = data.times[data.times.length - 1];
      this.time = this.start;
      this.speed = 1;
      this.loop = true;
      this.playing = this.end > this.start;
      this.chosen = new Set(data.chosen);
      this.style = {longest: data.longest, largest: data.largest, byRating: data.byRating,
        rating: data.rating, colors: data.colors, bending: data.largestBending};
      this.joint = 0;
      this.frame = -1;
      this.told = -Infinity;
      this.redraw = true;
      this.gui = new Map();
      this.named = new Map();
      this.html = [];
      this.plots = [];
      for (const message of data.messages) this.note(message);
      post({type: "connected"});
      post({type: "message_batch", messages: data.messages});
      this.label(this.playing);
      this.choose(0);
      this.before = performance.now();
      requestAnimationFrame(now => this.step(now));
    }

    note(message) {
      if (!message.type.startsWith("Gui") || !message.props) return;
      this.gui.set(message.uuid, message.props.label);
      if (message.props.label) this.named.set(message.props.label, message.uuid);
      if (message.type === "GuiHtmlMessage") this.html.push(message.uuid);
      if (message.type === "GuiUplotMessage") this.plots.push(message.uuid);
    }

    update(uuid, updates) {
      if (uuid) this.post({type: "message_batch", messages: [{type: "GuiUpdateMessage", uuid, updates}]});
    }

    label(playing) {
      this.update(this.named.get("Play"), {label: playing ? "Pause" : "Play"});
    }

    // What a person did.
    receive(message) {
      if (message.type === "SceneNodeClickMessage" && message.instance_index !== null) {
        const name = this.data.jointNames[message.instance_index];
        this.update(this.named.get("Joint"), {value: name});
        this.choose(message.instance_index);
      }
      if (message.type !== "GuiUpdateMessage") return;
      const label = this.gui.get(message.uuid), value = message.updates.value;
      this.redraw = true;
      if (label === "Play") {
        if (!this.playing && this.time >= this.end) this.time = this.start;
        this.playing = !this.playing && this.end > this.start;
        this.label(this.playing);
      } else if (label === "Time [s]") {
        this.time = Math.min(Math.max(value, this.start), this.end);
        if (this.playing) this.label(false);
        this.playing = false;
      } else if (label === "Speed") this.speed = SPEEDS[value] || Number(value);
      else if (label === "Loop") this.loop = value;
      else if (label === "Arrow size") this.style.longest = value * this.data.longest;
      else if (label === "Colour by rating") {
        this.style.byRating = value;
        this.update(this.html[1], {content: this.data.legends[value ? 1 : 0]});
      } else if (label === "Joint") {
        const joint = this.data.jointNames.indexOf(value);
        if (joint >= 0) this.choose(joint);
        else this.tell(`there is no joint '${value}'`);
      } else if (label in this.data.toggles) this.toggle(label, value);
      else if (this.data.causes.includes(label)) {
        if (value) this.chosen.add(label);
        else this.chosen.delete(label);
        this.choose(this.joint);
      }
    }

    toggle(label, visible) {
      this.data.toggles[label] = visible;
      const messages = this.data.layers.filter(layer => layer.toggle === label).map(
        layer => ({type: "SetSceneNodeVisibilityMessage", name: layer.name, visible, owner: ""}));
      this.post({type: "message_batch", messages});
    }

    // Loads of the joints from `first` on at a frame, of the chosen causes.
    loadsAt(frame, first = 0, count = this.n) {
      const {loads, causes} = this.data, out = new Float64Array(6 * count);
      for (let part = 0; part < this.parts; part++) {
        if (causes.length && !this.chosen.has(causes[part])) continue;
        const from = 6 * ((frame * this.parts + part) * this.n + first);
        for (let i = 0; i < out.length; i++) out[i] += loads[from + i];
      }
      return out;
    }

    moment(frame) {
      const {poses, beams, times} = this.data, size = poses.length / times.length;
      const width = beams.length / times.length;
      const here = poses.subarray(size * frame, size * (frame + 1));
      const points = new Float32Array(3 * this.n);
      for (let k = 0; k < this.n; k++) {
        for (let c = 0; c < 3; c++) points[3 * k + c] = here[7 * k + c];
      }
      const loads = this.parts ? this.loadsAt(frame) : null;
      const bent = beams.subarray(width * frame, width * (frame + 1));
      return {poses: here, points, loads, known: this.knownAt(frame), beams: bent};
    }

    // Which forces and moments are determinate at a frame, null: all.
    knownAt(frame) {
      const {known} = this.data, size = 2 * this.n;
      return known && known.subarray(known.length > size ? size * frame : 0).subarray(0, size);
    }

    choose(joint) {
      this.joint = joint;
      this.redraw = true;
      if (!this.plots.length) return;
      if (this.data.lines) {
        this.plots.forEach((uuid, half) => this.update(uuid, {series: this.data.lines[joint][half]}));
      }
      const total = this.data.times.length, count = Math.min(total, MOST_PLOTTED);
      this.plotted = Array.from({length: count}, (_, k) =>
        Math.floor(k * (total - 1) / Math.max(1, count - 1)));
      const rows = this.plotted.map(frame => this.loadsAt(frame, joint, 1));
      this.columns = [0, 3].map(from => [
        rows.map(row => Math.hypot(row[from], row[from + 1], row[from + 2])),
        ...[0, 1, 2].map(c => rows.map(row => row[from + c]))].map(part => Float64Array.from(part)));
      this.plotTimes = Float64Array.from(this.plotted, frame => this.data.times[frame]);
    }

    advance(seconds) {
      if (!this.playing) return;
      const ahead = this.time + seconds * this.speed;
      if (ahead < this.end) this.time = ahead;
      else if (this.loop) this.time = this.start + (ahead - this.start) % (this.end - this.start);
      else {
        this.time = this.end;
        this.playing = false;
        this.label(false);
        this.redraw = true;
      }
    }

    step(now) {
      this.advance((now - this.before) / 1000);
      this.before = now;
      const forced = this.redraw;
      this.redraw = false;
      if (this.playing || forced) this.draw(now, forced);
      requestAnimationFrame(then => this.step(then));
    }

    draw(now, forced) {
      const frame = nearest(this.data.times, this.time);
      if (frame !== this.frame || forced) {
        this.frame = frame;
        const moment = this.moment(frame);
        const messages = [];
        for (const layer of this.data.layers) {
          if (!this.data.toggles[layer.toggle] || (layer.kind === "loads" && !moment.loads)) continue;
          const updates = place[layer.kind](moment, layer, this.style);
          if (Object.keys(updates).length === 0) continue;
          messages.push({type: "SceneNodeUpdateMessage", name: layer.name, updates, owner: ""});
        }
        this.post({type: "message_batch", messages});
      }
      if (!forced && now - this.told < PLOT_INTERVAL) return;
      this.told = now;
      this.update(this.named.get("Time [s]"), {value: this.time});
      this.plot();
      const load = this.parts ? this.loadsAt(frame, this.joint, 1) : null;
      if (!load) return;
      const head = this.data.film ? `t = ${general(this.data.times[frame])} s: ` : "held still: ";
      const [force, moment] = [0, 3].map(i => Math.hypot(load[i], load[i + 1], load[i + 2]));
      const known = this.knownAt(frame), {sometimes} = this.data;
      const bracketed = (size, half) => {
        const shown = general(size);
        return !known || known[2 * this.joint + half] ? shown : `(${shown})`;
      };
      const other = ["force", "moment"].filter(
        (_, half) => known && known[2 * this.joint + half] && sometimes[2 * this.joint + half]);
      const tail = other.length ? `; ${other.join(" and ")} not determined in other poses` : "";
      this.tell(`${head}${bracketed(force, 0)} N, ${bracketed(moment, 1)} N m${tail}`);
    }

    plot() {
      if (!this.plots.length) return;
      const dot = nearest(this.plotTimes, this.time);
      this.plots.forEach((uuid, half) => {
        const mark = new Float64Array(this.plotTimes.length).fill(NaN);
        mark[dot] = this.columns[half][0][dot];
        this.update(uuid, {data: [this.plotTimes, ...this.columns[half], mark]});
      });
    }

    tell(text) {
      const safe = document.createElement("i");
      safe.textContent = text;
      const style = "padding:2px 12px;font-size:12px";
      this.update(this.html[2], {content: `<div style="${style}">${safe.innerHTML}</div>`});
    }
  }

  // Index of the time nearest to `time`.
  function nearest(times, time) {
    let low = 0, high = times.length - 1;
    while (high - low > 1) {
      const middle = (low + high) >> 1;
      if (times[middle] <= time) low = middle;
      else high = middle;
    }
    return time - times[low] <= times[high] - time ? low : high;
  }

  // The client would write the address of its server into the page's own.
  window.history.replaceState = () => {};
  const content = read();
  window.Worker = class {
    postMessage(message) {
      if (message.type === "set_server") {
        content.then(data => {
          this.player = new Player(data, answer => this.onmessage({data: answer}));
          window.linkwise = {player: this.player, place}; // for tests
        });
      } else if (message.type === "send" && this.player) {
        this.player.receive(message.message);
      }
    }

    terminate() {}
  };
})();
