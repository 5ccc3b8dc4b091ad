'use strict';
// Plots over the frames, on canvases of their own: makePlots(element, onTime) returns {setFrames, setTime}.
(() => {
  const css = name => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
  // Colour, and part of the height: orange and red are alike for readers without red or green cones.
  const kStates = {
    tracking: ['--green', 1], ok: ['--green', 1], stationary: ['--light-blue', 1], standing: ['--light-blue', 1],
    degraded: ['--orange', 0.65], suspect: ['--orange', 0.65], lost: ['--red', 0.35], excluded: ['--red', 0.35], missing: ['--soft', 0.2]};
  const number = value => value === null || value === undefined ? '–' : String(+value.toPrecision(3));

  // The largest of each pixel column, so that 10 000 frames are as many lines as there are pixels.
  const columnsOf = (values, width) => {
    const count = values.length, columns = new Array(width).fill(null);
    for (let i = 0; i < count; ++i) {
      const value = values[i];
      if (value === null || !Number.isFinite(value)) continue;
      const x = count > 1 ? Math.round(i / (count - 1) * (width - 1)) : 0;
      if (columns[x] === null || value > columns[x]) columns[x] = value;
    }
    return columns;
  };

  window.makePlots = (element, onTime) => {
    let plots = [], frames = null, now = 0;

    const size = canvas => {
      const scale = window.devicePixelRatio || 1, width = Math.max(1, Math.round(canvas.clientWidth * scale));
      const height = Math.max(1, Math.round(canvas.clientHeight * scale));
      if (canvas.width !== width) canvas.width = width;
      if (canvas.height !== height) canvas.height = height;
      return {width, height, scale};
    };
    const drawLines = (plot, context, {width, height, scale}) => {
      const largest = Math.max(...plot.series.map(s => s.columns.reduce((most, v) => v !== null && v > most ? v : most, 0)), 1e-9);
      const top = plot.limit ? Math.min(Math.max(largest, 1.2 * plot.limit), 4 * plot.limit) : largest;
      context.strokeStyle = css('--rule');
      context.lineWidth = 1;
      context.strokeRect(0.5, 0.5, width - 1, height - 1);
      if (plot.limit) {
        const y = Math.round(height - 2 - plot.limit / top * (height - 4)) + 0.5;
        context.setLineDash([2 * scale, 3 * scale]);
        context.strokeStyle = css('--ink');
        context.beginPath();
        context.moveTo(0, y);
        context.lineTo(width, y);
        context.stroke();
      }
      for (const series of plot.series) {
        context.strokeStyle = css(series.colour);
        context.lineWidth = 1.5 * scale;
        context.setLineDash(series.dash ? series.dash.map(d => d * scale) : []);
        const points = [];
        series.columns.forEach((value, x) => {
          if (value !== null) points.push({x, y: height - 2 - Math.min(value / top, 1) * (height - 4), above: plot.limit && value > plot.limit});
        });
        if (!plot.limit) {
          context.beginPath();
          points.forEach(({x, y}, i) => i > 0 ? context.lineTo(x, y) : context.moveTo(x, y));
          context.stroke();
          if (points.length > 1) continue;
        }
        // Tests are single events; those beyond the plot are at its upper edge.
        const side = 2 * scale;
        for (const {x, y, above} of points) {
          context.fillStyle = css(above ? '--red' : series.colour);
          context.fillRect(x - side / 2, y - side / 2, above ? 1.5 * side : side, above ? 1.5 * side : side);
        }
      }
      context.setLineDash([]);
    };
    const drawStrip = (plot, context, {width, height}) => {
      const states = plot.states, count = states.length;
      for (let i = 0; i < count;) {
        let end = i + 1;
        while (end < count && states[end] === states[i]) ++end;
        if (states[i] !== null) {
          const [colour, part] = kStates[states[i]] || kStates.missing, high = Math.round(part * height);
          context.fillStyle = css(colour);
          context.fillRect(i / count * width, height - high, Math.max(1, (end - i) / count * width), high);
        }
        i = end;
      }
    };
    const draw = plot => {
      const area = size(plot.canvas), context = plot.canvas.getContext('2d');
      context.clearRect(0, 0, area.width, area.height);
      if (plot.states) {
        drawStrip(plot, context, area);
      } else {
        for (const series of plot.series) series.columns = columnsOf(series.values, area.width);
        drawLines(plot, context, area);
      }
      const count = frames.total;
      const x = count > 1 ? now / (count - 1) * (area.width - 1) : 0;
      context.fillStyle = css('--ink');
      context.fillRect(Math.round(x), 0, Math.max(1, area.scale), area.height);
      plot.value.textContent = plot.states ? plot.states[now] || '–'
        : plot.series.map(s => `${number(s.values[now])}${plot.unit}`).join(', ');
      plot.canvas.setAttribute('aria-label', `${plot.title}: ${plot.value.textContent}`);
    };

    const add = plot => {
      const box = document.createElement('div'), title = document.createElement('div'), value = document.createElement('span');
      box.className = plot.states ? 'plot strip' : 'plot';
      title.className = 'title';
      value.className = 'value';
      const name = document.createElement('b');
      name.textContent = plot.title;
      title.append(name);
      for (const series of plot.series || []) {
        const key = document.createElement('span'), swatch = document.createElement('span');
        key.className = 'key';
        swatch.className = 'swatch';
        swatch.style.background = `var(${series.colour})`;
        key.append(swatch, series.name);
        title.append(key);
      }
      title.append(value);
      plot.canvas = document.createElement('canvas');
      plot.canvas.setAttribute('role', 'img');
      plot.value = value;
      const point = event => {
        const box = plot.canvas.getBoundingClientRect(), part = (event.clientX - box.left) / box.width;
        onTime(Math.round(Math.min(Math.max(part, 0), 1) * (frames.total - 1)));
      };
      plot.canvas.addEventListener('pointerdown', point);
      plot.canvas.addEventListener('pointermove', event => event.buttons && point(event));
      box.append(title, plot.canvas);
      element.append(box);
      plots.push(plot);
    };
    const build = () => {
      element.replaceChildren();
      plots = [];
      add({title: 'Odometry', states: frames.status});
      for (const [name, states] of Object.entries(frames.sensors)) add({title: name, states});
      add({title: 'Landmarks', unit: '', series: [
        {name: 'inliers', colour: '--green', values: frames.inliers}, {name: 'matches', colour: '--blue', dash: [4, 3], values: frames.matches}]});
      add({title: 'Residual, RMS', unit: ' px', series: [{name: 'inliers', colour: '--blue', values: frames.rms_px}]});
      const sigma = axis => frames.sigma_m.map(s => s && 1000 * s[axis]);
      add({title: 'σ of the position', unit: ' mm', series: [
        {name: 'x', colour: '--red', values: sigma(0)}, {name: 'y', colour: '--green', dash: [5, 3], values: sigma(1)},
        {name: 'z', colour: '--blue', dash: [2, 2], values: sigma(2)}]});
      for (const [name, values] of Object.entries(frames.innovations))
        add({title: `Innovation: ${name}`, unit: '', limit: 1, series: [{name: 'NIS / gate', colour: '--blue', values}]});
      if (frames.latency_ms.some(v => v !== null))
        add({title: 'Latency', unit: ' ms', series: [{name: 'image to pose', colour: '--purple', values: frames.latency_ms}]});
      const colours = ['--blue', '--orange', '--green', '--red', '--purple', '--light-blue'];
      Object.entries(frames.stages).forEach(([name, values], i) =>
        add({title: `Time: ${name}`, unit: ' ms', series: [{name, colour: colours[i % colours.length], values}]}));
    };
    new ResizeObserver(() => plots.forEach(draw)).observe(element);

    return {
      setFrames(columns) {
        frames = columns;
        build();
        plots.forEach(draw);
      },
      setTime(index) {
        now = index;
        plots.forEach(draw);
      },
      repaint: () => plots.forEach(draw),
      count: () => plots.length,
    };
  };
})();
