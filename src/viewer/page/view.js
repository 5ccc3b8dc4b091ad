'use strict';
// Asks for the run, shows it, and, while it goes on, asks again every second.
(() => {
  const at = id => document.getElementById(id);
  const hasWebGl = Boolean(document.createElement('canvas').getContext('webgl'));
  if (!hasWebGl) at('scene').textContent = 'This browser does not draw in 3D (WebGL).';
  const scene = hasWebGl ? makeScene(at('scene')) : new Proxy({}, {get: () => () => null}), plots = makePlots(at('plots'), index => show(index));
  let run = null, frames = null, now = 0, playing = null, mapShown = 0, nextMap = 0, shownView = -1, request = 0, imaged = -1;
  const errors = [];

  const get = async (path, kind = 'json') => {
    const response = await fetch(path);
    if (!response.ok) throw new Error(await response.text());
    return kind === 'json' ? response.json() : response.arrayBuffer();
  };

  const paint = () => scene.legend(at('scene-legend'), scene.colourBy(at('colour-by').value));

  // ---- one moment

  const drawLandmarks = data => {
    const canvas = at('landmarks'), image = at('image');
    canvas.width = image.naturalWidth || 1;
    canvas.height = image.naturalHeight || 1;
    const context = canvas.getContext('2d');
    context.lineWidth = Math.max(1, canvas.width / 500);
    for (const [x0, y0, x1, y1, inlier] of data.tracks) {
      context.strokeStyle = inlier ? '#00d08a' : '#ff7f2a';  // on gray images: green and orange differ in lightness, too
      context.beginPath();
      context.moveTo(data.unit_px * x0, data.unit_px * y0);
      context.lineTo(data.unit_px * x1, data.unit_px * y1);
      context.stroke();
      context.beginPath();
      context.arc(data.unit_px * x1, data.unit_px * y1, canvas.width / (inlier ? 320 : 450), 0, 2 * Math.PI);
      context.stroke();
    }
    const agree = data.tracks.filter(t => t[4]).length;
    at('image-note').textContent += data.tracks.length === 0 ? 'No motion was measured to this frame.'
      : `${agree} inliers (green), ${data.tracks.length - agree} outliers (orange), and where they were in the frame before.`;
  };
  // What the server has sent as the image: an address, or, where it has none, why.
  const loadImage = async index => {
    const response = await fetch(`/api/image?frame=${index}`);
    if (!response.ok) throw new Error(await response.text());
    if (response.status === 204) throw new Error('The image of this frame is not recorded yet.');
    return URL.createObjectURL(await response.blob());
  };
  // While a live run goes on, its newest images may not be recorded yet: the last recorded one is shown, and named.
  const imageOf = index => !run.ended && run.last_image >= 0 ? Math.min(index, run.last_image) : index;
  const showImage = async index => {
    const mine = ++request, shown = imaged = imageOf(index), image = at('image');
    if (!run.has_images) {
      at('image-note').textContent = 'No images: name the recording by --recording.';
      return;
    }
    try {
      const source = await loadImage(shown), before = image.src;
      if (mine !== request) return URL.revokeObjectURL(source);
      image.src = source;
      URL.revokeObjectURL(before);
      await image.decode();
    } catch (error) {
      if (mine !== request) return;
      URL.revokeObjectURL(image.src);
      image.removeAttribute('src');
      at('landmarks').width = 1;
      at('image-note').textContent = error.message;
      if (!run.ended) setTimeout(() => mine === request && showImage(index), 1000);  // it may not be on disk yet
      return;
    }
    if (mine !== request) return;
    at('landmarks').width = 1;  // no landmarks of another frame
    at('image-note').textContent = shown === index ? '' : `Image of frame ${shown + 1}: later ones are not recorded yet. `;
    if (!at('show-landmarks').checked || playing) return;
    try {
      const data = await get(`/api/landmarks?frame=${shown}`);
      if (mine === request) drawLandmarks(data);
    } catch (error) {
      if (mine === request) at('image-note').textContent = error.message;
    }
  };
  // The last terrain view at or before the frame.
  const showDisparity = index => {
    let view = -1;
    run.terrain.forEach((frame, i) => { if (frame >= 0 && frame <= index) view = i; });
    at('disparity-panel').classList.toggle('hidden', run.terrain.length === 0);
    if (view === shownView) return;
    shownView = view;
    if (view < 0) {
      at('disparity').removeAttribute('src');
      at('disparity-note').textContent = 'There is no terrain view before this frame.';
      return;
    }
    at('disparity').src = `/api/disparity?view=${view}`;
    at('disparity-note').textContent = `Terrain view ${view + 1} of ${run.terrain.length}, at ${frames.t_s[run.terrain[view]].toFixed(2)} s. Near is red, unknown black.`;
  };
  let waiting = null;
  const show = index => {
    now = index;
    at('time').value = index;
    const status = frames.status[index], message = frames.message[index];
    at('frame').textContent = `${index + 1} of ${frames.total}, ${frames.t_s[index].toFixed(2)} s, ${status}`;
    at('frame').title = message;
    scene.setTime(index);
    plots.setTime(index);
    showDisparity(index);
    clearTimeout(waiting);
    waiting = setTimeout(() => showImage(index), playing ? 0 : 80);
  };

  // ---- the run as it grows

  const append = more => {
    if (!frames || more.from === 0) return more;
    for (const [name, value] of Object.entries(more)) {
      if (Array.isArray(value)) frames[name] = frames[name].concat(value);
    }
    for (const table of ['stages', 'sensors', 'innovations']) {
      for (const [name, values] of Object.entries(more[table])) {
        frames[table][name] = (frames[table][name] || new Array(more.from).fill(null)).concat(values);
      }
      for (const values of Object.values(frames[table])) while (values.length < more.total) values.push(null);
    }
    frames.total = more.total;
    return frames;
  };
  // A growing map takes longer and longer to make: at most a tenth of the time is spent on it.
  const showMap = async () => {
    if (run.map_version === mapShown || (!run.ended && performance.now() < nextMap)) return;
    const asked = performance.now();
    try {
      scene.setMap(await get('/api/map', 'buffer'));
      mapShown = run.map_version;
      at('scene-note').textContent = '';
    } catch (error) {
      at('scene-note').textContent = `No map: ${error.message}`;
    }
    nextMap = performance.now() + 9 * (performance.now() - asked);
    paint();
  };
  // When a run ends, its smoothed trajectory changes frames that are here already, as does a run that was resumed from a
  // checkpoint: all are asked for again.
  const refresh = async () => {
    const before = run;
    run = await get('/api/run');
    document.title = `Spartan: ${run.name}`;
    at('name').textContent = run.name;
    const have = frames ? frames.total : 0, first = have === 0, last = frames && now === frames.total - 1;
    const again = run.frames < have || (before && (run.generation !== before.generation || run.ended !== before.ended));
    if (run.frames !== have || again) {
      frames = append(await get(`/api/frames?from=${again ? 0 : have}`));
      at('time').max = frames.total - 1;
      scene.setFrames(frames);
      plots.setFrames(frames);
      if (frames.total > 0) show(first ? (run.ended ? 0 : frames.total - 1) : last ? frames.total - 1 : Math.min(now, frames.total - 1));
      paint();
    } else if (frames.total > 0 && imageOf(now) !== imaged) {
      showImage(now);
    }
    at('state').textContent = `${run.frames} frames, ${run.terrain.length} terrain views, ${run.maps} local maps, rig ${run.rig}${run.ended ? '' : '; the run goes on'}`;
    await showMap();
  };
  // An ended run, all of which is here, may be resumed.
  const follow = async () => {
    let complete = false;
    try {
      await refresh();
      complete = run.ended && frames && frames.total === run.frames;
    } catch (error) {
      errors.push(error.message);
      at('state').textContent = `Not answered: ${error.message}`;
    }
    setTimeout(follow, complete ? 10000 : 1000);
  };

  // ---- controls

  at('time').addEventListener('input', () => show(+at('time').value));
  at('colour-by').addEventListener('change', paint);
  at('from-above').addEventListener('click', () => scene.fromAbove());
  at('follow-rover').addEventListener('click', event => {
    const on = event.target.getAttribute('aria-pressed') !== 'true';
    event.target.setAttribute('aria-pressed', on);
    scene.follow(on);
  });
  at('show-landmarks').addEventListener('change', () => showImage(now));
  const play = on => {
    at('play').setAttribute('aria-pressed', on);
    at('play').textContent = on ? 'Pause' : 'Play';
    clearInterval(playing);
    playing = on ? setInterval(() => show((now + 1) % frames.total), 100) : null;
    if (!on) showImage(now);
  };
  at('play').addEventListener('click', () => frames && play(!playing));
  window.matchMedia('(prefers-color-scheme: dark)').addEventListener('change', () => {
    scene.repaint();
    plots.repaint();
  });
  window.spartan = {scene, plots, errors, state: () => ({now, total: frames ? frames.total : 0, mapShown, imaged})};  // for tests
  follow();
})();
