'use strict';
// The terrain and the trajectories in 3D: makeScene(element) returns an object with setMap(), setFrames(),
// setTime(), colourBy(), legend() and more.
// World axes: x forward or east, y left or north, z up, in metres.
(() => {
  // "cividis" (Nuñez, Anderton & Renslow, PLOS ONE 2018) at eight points: even steps of lightness, also for colour-blind readers.
  const kRamp = [[0, 34, 78], [33, 60, 110], [74, 84, 109], [104, 110, 114], [136, 136, 121], [172, 163, 113], [211, 193, 96], [253, 232, 64]];
  // Unknown, free, obstacle, cavity (Okabe & Ito).
  const kClasses = [[150, 150, 150], [120, 190, 165], [213, 94, 0], [0, 114, 178]];
  const kUnknown = [170, 165, 160];
  const kSteps = [1, 2, 4, 8];  // cells between the vertices of the terrain's levels of detail
  // These differ for readers without red or green cones, too: a light blue does not differ from the blue.
  const kTrajectories = {odometry: '--orange', slam: '--ink', localization: '--blue', smoothed: '--purple'};

  const ramp = value => {
    const at = Math.min(Math.max(value, 0), 1) * (kRamp.length - 1), low = Math.min(Math.floor(at), kRamp.length - 2), part = at - low;
    return kRamp[low].map((c, i) => c + part * (kRamp[low + 1][i] - c));
  };
  const rampCss = () => `linear-gradient(to right, ${kRamp.map(c => `rgb(${c})`).join(', ')})`;
  const css = name => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

  const key = (text, colour) => {
    const made = document.createElement('span'), swatch = document.createElement('span');
    made.className = 'key';
    swatch.className = 'swatch';
    swatch.style.background = colour;
    made.append(swatch, text);
    return made;
  };

  // The 2nd and the 98th percentile of the known values.
  const spanOf = values => {
    const known = Float32Array.from(values.filter(v => Number.isFinite(v))).sort();
    if (known.length === 0) return [0, 1];
    const low = known[Math.floor(0.02 * (known.length - 1))], high = known[Math.floor(0.98 * (known.length - 1))];
    return high > low ? [low, high] : [low, low + 1e-6];
  };

  const readMap = buffer => {
    const length = new DataView(buffer).getUint32(0, true);
    const header = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, length)));
    const cells = header.width * header.height, map = {...header};
    for (const {name, type, offset} of header.layers) {
      const at = 4 + length + offset;
      map[name] = type === 'float32' ? new Float32Array(buffer, at, cells)
        : new Uint8Array(buffer, at, type === 'rgb8' ? 3 * cells : cells);
    }
    return map;
  };

  // Vertex numbers of the triangles over every `step`-th cell: two between four known cells, one between three.
  const trianglesOf = ({width, height}, numbers, step) => {
    const triangles = [], down = step * width;
    for (let r = 0; r + step < height; r += step) {
      for (let c = 0; c + step < width; c += step) {
        const i = r * width + c, known = [i, i + down, i + down + step, i + step].map(k => numbers[k]).filter(n => n >= 0);
        if (known.length >= 3) triangles.push(known[0], known[1], known[2]);
        if (known.length === 4) triangles.push(known[0], known[2], known[3]);
      }
    }
    return new THREE.Uint32BufferAttribute(triangles, 1);
  };
  // `levels`: indices of the same vertices, each of a quarter of the triangles of the one before.
  const terrainGeometry = map => {
    const {width, height, cell_m: cell} = map, numbers = new Int32Array(width * height).fill(-1), positions = [], cells = [];
    for (let i = 0; i < width * height; ++i) {
      if (!Number.isFinite(map.elevation_m[i])) continue;
      numbers[i] = cells.length;
      cells.push(i);
      positions.push(map.west_m + (i % width + 0.5) * cell, map.north_m - (Math.floor(i / width) + 0.5) * cell, map.elevation_m[i]);
    }
    const levels = kSteps.map(step => trianglesOf(map, numbers, step));
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute('position', new THREE.Float32BufferAttribute(positions, 3));
    geometry.setAttribute('color', new THREE.BufferAttribute(new Uint8Array(3 * cells.length), 3, true));
    geometry.setIndex(levels[0]);
    geometry.computeVertexNormals();
    geometry.computeBoundingSphere();
    return {geometry, cells: Int32Array.from(cells), levels};
  };

  const rover = () => {
    const cone = new THREE.ConeBufferGeometry(0.12, 0.4, 4);
    cone.rotateZ(-Math.PI / 2);  // towards +x
    const mesh = new THREE.Mesh(cone, new THREE.MeshLambertMaterial({color: 0xd55e00}));
    mesh.position.z = 0.1;
    const group = new THREE.Group();
    group.add(mesh);
    return group;
  };

  // The horizontal ellipse of three standard deviations, of a covariance [xx, xy, yy].
  const ellipsePoints = ([xx, xy, yy], [x, y, z], points) => {
    const mean = (xx + yy) / 2, half = Math.hypot((xx - yy) / 2, xy), angle = Math.atan2(2 * xy, xx - yy) / 2;
    const a = 3 * Math.sqrt(Math.max(0, mean + half)), b = 3 * Math.sqrt(Math.max(0, mean - half)), kSteps = 24;
    let last = null;
    for (let k = 0; k <= kSteps; ++k) {
      const u = a * Math.cos(2 * Math.PI * k / kSteps), v = b * Math.sin(2 * Math.PI * k / kSteps);
      const next = [x + u * Math.cos(angle) - v * Math.sin(angle), y + u * Math.sin(angle) + v * Math.cos(angle), z];
      if (last) points.push(...last, ...next);
      last = next;
    }
  };

  const between = (a, b) => Math.hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
  // Distance of p from the segment from a to b.
  const off = (p, a, b) => {
    const length = between(a, b), part = length > 0
      ? [0, 1, 2].reduce((sum, i) => sum + (p[i] - a[i]) * (b[i] - a[i]), 0) / (length * length) : 0;
    const t = Math.min(Math.max(part, 0), 1);
    return between(p, [0, 1, 2].map(i => a[i] + t * (b[i] - a[i])));
  };
  // Points of a line that is nowhere farther than `tolerance` from the given one (Douglas and Peucker, 1973).
  const simplified = (points, tolerance) => {
    const keep = new Uint8Array(points.length), spans = [[0, points.length - 1]];
    keep[0] = keep[points.length - 1] = 1;
    while (spans.length > 0) {
      const [first, last] = spans.pop();
      let farthest = -1, most = tolerance;
      for (let i = first + 1; i < last; ++i) {
        const distance = off(points[i], points[first], points[last]);
        if (distance > most) [farthest, most] = [i, distance];
      }
      if (farthest < 0) continue;
      keep[farthest] = 1;
      spans.push([first, farthest], [farthest, last]);
    }
    return points.filter((_, i) => keep[i]);
  };
  // Coordinates of a line of few points: the time to draw wide lines is that of their segments. First of at most some 1500,
  // without those that are nearer to the one before than a share of its length.
  const thinned = positions => {
    const known = positions.filter(p => p), points = [];
    let length = 0;
    for (let i = 1; i < known.length; ++i) length += between(known[i - 1], known[i]);
    let last = null;
    known.forEach((p, i) => {
      if (last && i + 1 < known.length && between(last, p) < length / 1500) return;
      points.push(p);
      last = p;
    });
    return points.length === 0 ? [] : simplified(points, Math.max(0.002, 2e-5 * length)).flatMap(p => [p[0], p[1], p[2] + 0.02]);
  };

  window.makeScene = element => {
    const renderer = new THREE.WebGLRenderer({antialias: true, alpha: true, preserveDrawingBuffer: true});
    renderer.setPixelRatio(Math.min(window.devicePixelRatio, 2));
    element.append(renderer.domElement);
    const scene = new THREE.Scene(), camera = new THREE.PerspectiveCamera(45, 1, 0.05, 5000);
    camera.up.set(0, 0, 1);
    camera.position.set(-4, -4, 4);
    scene.add(new THREE.HemisphereLight(0xffffff, 0x887766, 0.75));
    const sun = new THREE.DirectionalLight(0xffffff, 0.55);
    sun.position.set(-1, 1, 1.5);
    scene.add(sun);
    const controls = new THREE.OrbitControls(camera, renderer.domElement);
    controls.screenSpacePanning = false;
    controls.enableKeys = false;  // the element has the keys and the focus
    renderer.domElement.tabIndex = -1;
    const marker = rover(), lines = {}, limits = {};
    scene.add(marker);
    let terrain = null, map = null, layer = 'colour', framed = false, mapFramed = false, following = false, asked = false, frames = null, now = 0;
    let drawn = 0;

    const useLevel = level => {
      if (terrain) terrain.geometry.setIndex(terrain.userData.levels[level]);
    };
    // While the scene moves, the terrain gets coarser until a frame takes at most kFluid_ms, as long as that makes frames
    // quicker: without a graphics card most of the time may be that of the browser. At rest it has all triangles.
    const kFluid_ms = 40, kRest_ms = 500, kFrames = 6;
    let level = 0, coarser = true, before = Infinity, times = [], lastDrawn = -Infinity, rest = null;
    const chooseLevel = took => {
      times.push(took);
      if (times.length < kFrames) return;
      const mean = times.slice(1).reduce((sum, ms) => sum + ms) / (kFrames - 1);  // the first is of the level before
      times = [];
      if (mean > 0.9 * before) {
        [level, coarser, before] = [level - 1, false, Infinity];
      } else if (coarser && mean > kFluid_ms && level + 1 < kSteps.length) {
        [level, before] = [level + 1, mean];
      } else {
        before = Infinity;
      }
    };
    const render = () => {
      const distance = camera.position.distanceTo(controls.target);  // metres in a drive of a rover, kilometres in one of a car
      camera.near = Math.max(0.05, distance / 500);
      camera.far = 5000 + 100 * distance;
      camera.updateProjectionMatrix();
      marker.scale.setScalar(Math.max(1, distance / 40));  // visible from afar
      renderer.render(scene, camera);
      ++drawn;
    };
    const renderAtRest = () => {
      lastDrawn = -Infinity;
      [level, coarser, before, times] = [Math.max(level - 1, 0), true, Infinity, []];  // the next movement may be quicker
      if (!terrain || terrain.geometry.index === terrain.userData.levels[0]) return;
      useLevel(0);
      render();
    };
    const draw = () => {
      asked = false;
      const time = performance.now(), moving = time - lastDrawn < kRest_ms;
      if (moving) chooseLevel(time - lastDrawn);
      lastDrawn = time;
      useLevel(moving ? level : 0);
      render();
      clearTimeout(rest);
      rest = setTimeout(renderAtRest, kRest_ms);
    };
    const ask = () => {
      if (!asked) requestAnimationFrame(draw);
      asked = true;
    };
    const resize = () => {
      const {clientWidth: width, clientHeight: height} = element;
      if (width === 0 || height === 0) return;
      renderer.setSize(width, height);
      for (const {material} of Object.values(lines)) if (material.resolution) material.resolution.set(width, height);
      camera.aspect = width / height;
      render();  // at once: the new size has cleared the canvas
    };
    new ResizeObserver(resize).observe(element);
    controls.addEventListener('change', ask);
    element.addEventListener('pointerdown', () => element.focus());  // which OrbitControls prevents
    const move = (right, ahead) => {
      const forward = new THREE.Vector3().subVectors(controls.target, camera.position).setZ(0).normalize();
      const step = camera.position.distanceTo(controls.target) / 12;
      const by = new THREE.Vector3(forward.y, -forward.x, 0).multiplyScalar(right * step).addScaledVector(forward, ahead * step);
      camera.position.add(by);
      controls.target.add(by);
    };
    // Around the target, which stays in the middle; `zoom`: factor of the distance.
    const orbit = (right, up, zoom) => {
      const kTurn_rad = Math.PI / 24, kLeast_rad = 0.01;  // from the vertical
      const offset = new THREE.Vector3().subVectors(camera.position, controls.target).multiplyScalar(zoom);
      const distance = offset.length(), azimuth = Math.atan2(offset.y, offset.x) + right * kTurn_rad;
      const polar = Math.min(Math.max(Math.acos(offset.z / distance) - up * kTurn_rad, kLeast_rad), Math.PI - kLeast_rad);
      const level = distance * Math.sin(polar);
      offset.set(level * Math.cos(azimuth), level * Math.sin(azimuth), distance * Math.cos(polar));
      camera.position.copy(controls.target).add(offset);
    };
    const kZoom = 1.2;
    element.addEventListener('keydown', event => {
      const arrow = {ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1]}[event.key];
      const zoom = {'+': 1 / kZoom, '=': 1 / kZoom, '-': kZoom, '_': kZoom}[event.key];
      if (event.ctrlKey || event.metaKey || event.altKey || (!arrow && !zoom)) return;  // such as the zoom of the browser
      event.preventDefault();
      if (zoom) {
        orbit(0, 0, zoom);
      } else if (event.shiftKey) {
        orbit(...arrow, 1);
      } else {
        move(...arrow);
      }
      controls.update();
      ask();
    });

    const look = (centre, radius, direction) => {
      controls.target.copy(centre);
      camera.position.copy(centre).addScaledVector(direction, Math.max(radius, 1) * 2.2);
      controls.update();
      ask();
    };
    const whole = () => {
      const box = new THREE.Box3();
      if (terrain) box.expandByObject(terrain);
      for (const pose of frames ? frames.pose : []) if (pose) box.expandByPoint(new THREE.Vector3(pose[0], pose[1], pose[2]));
      if (box.isEmpty()) return {centre: new THREE.Vector3(), radius: 2};
      const sphere = box.getBoundingSphere(new THREE.Sphere());
      return {centre: sphere.center, radius: sphere.radius};
    };
    const frameAll = direction => {
      const {centre, radius} = whole();
      look(centre, radius, direction.normalize());
    };

    const paint = () => {
      if (!terrain) return null;
      const {cells} = terrain.userData, colours = terrain.geometry.getAttribute('color');
      const values = map[layer], span = layer === 'colour' || layer === 'class' ? null
        : layer === 'cost' ? [0, 1] : limits[layer] || (limits[layer] = spanOf(values));
      cells.forEach((cell, vertex) => {
        const colour = layer === 'colour' ? [values[3 * cell], values[3 * cell + 1], values[3 * cell + 2]]
          : layer === 'class' ? kClasses[values[cell]]
          : Number.isFinite(values[cell]) ? ramp((values[cell] - span[0]) / (span[1] - span[0])) : kUnknown;
        colours.array.set(colour, 3 * vertex);
      });
      colours.needsUpdate = true;
      ask();
      return span;
    };
    // Drawn over the terrain, whose cells may be a little higher.
    const setLine = (name, line) => {
      if (lines[name]) {
        scene.remove(lines[name]);
        lines[name].geometry.dispose();
      }
      line.renderOrder = 1;
      lines[name] = line;
      scene.add(line);
    };
    const wideLine = (points, colour) => {
      const geometry = new THREE.LineGeometry();
      geometry.setPositions(points);
      const material = new THREE.LineMaterial({color: new THREE.Color(colour), linewidth: 2.5, depthTest: false, transparent: true});
      material.resolution.set(element.clientWidth, element.clientHeight);
      return new THREE.Line2(geometry, material);
    };
    // `ends`: of each segment.
    const thinSegments = (ends, colour) => {
      const geometry = new THREE.BufferGeometry();
      geometry.setAttribute('position', new THREE.Float32BufferAttribute(ends, 3));
      return new THREE.LineSegments(geometry, new THREE.LineBasicMaterial({color: new THREE.Color(colour), depthTest: false, transparent: true}));
    };

    const api = {
      setMap(buffer) {
        map = readMap(buffer);
        if (terrain) {
          scene.remove(terrain);
          terrain.geometry.dispose();
        }
        for (const name of Object.keys(limits)) delete limits[name];
        const {geometry, cells, levels} = terrainGeometry(map);
        terrain = new THREE.Mesh(geometry, new THREE.MeshLambertMaterial({vertexColors: THREE.VertexColors, side: THREE.DoubleSide}));
        terrain.userData = {cells, levels};
        scene.add(terrain);
        const span = paint();
        if (!mapFramed) {
          mapFramed = framed = true;
          frameAll(new THREE.Vector3(-0.7, -0.7, 0.8));
        }
        return span;
      },
      setFrames(columns) {
        frames = columns;
        for (const [kind, colour] of Object.entries(kTrajectories)) {
          const points = thinned(columns[kind]);
          if (points.length > 3) setLine(kind, wideLine(points, css(colour)));
        }
        // At most 60 ellipses, evenly.
        const step = Math.max(1, Math.floor(columns.pose.length / 60)), points = [];
        for (let i = 0; i < columns.pose.length; i += step) {
          if (columns.pose[i]) ellipsePoints(columns.ellipse_m2[i], [columns.pose[i][0], columns.pose[i][1], columns.pose[i][2] + 0.02], points);
        }
        if (points.length > 0) setLine('ellipses', thinSegments(points, css('--blue')));
        if (!framed && !terrain && columns.pose.length > 1) {
          framed = true;  // once: then the camera is the user's, until there is a map
          frameAll(new THREE.Vector3(-0.7, -0.7, 0.8));
        }
        ask();
      },
      setTime(index) {
        now = index;
        const pose = frames && frames.pose[index];
        marker.visible = Boolean(pose);
        if (pose) {
          const before = marker.position.clone();
          marker.position.set(pose[0], pose[1], pose[2]);
          marker.quaternion.set(pose[3], pose[4], pose[5], pose[6]);
          if (following) {
            const moved = marker.position.clone().sub(before);
            camera.position.add(moved);
            controls.target.copy(marker.position);
            controls.update();
          }
        }
        ask();
      },
      colourBy(name) {
        layer = name;
        return paint();
      },
      fromAbove() {
        frameAll(new THREE.Vector3(0, -0.001, 1));
      },
      follow(on) {
        following = on;
        if (on) {
          controls.target.copy(marker.position);
          camera.position.copy(marker.position).add(new THREE.Vector3(-4, -2, 3));
          controls.update();
          ask();
        }
      },
      repaint() {
        if (frames) api.setFrames(frames);
      },
      // Of a test: draws so many frames while the camera turns, and returns the time of each in ms.
      async measure(count) {
        const times = [];
        let last = performance.now();
        for (let i = 0; i < count; ++i) {
          const offset = camera.position.clone().sub(controls.target).applyAxisAngle(new THREE.Vector3(0, 0, 1), 0.02);
          camera.position.copy(controls.target).add(offset);
          controls.update();                                       // asks for a frame,
          await new Promise(done => requestAnimationFrame(done));  // which is drawn before
          renderer.getContext().finish();
          times.push(performance.now() - last);
          last = performance.now();
        }
        return times;
      },
      // Fills an element with the keys of what is drawn; `span` as colourBy() returns it.
      legend(box, span) {
        box.replaceChildren();
        for (const [kind, colour] of Object.entries(kTrajectories)) if (lines[kind]) box.append(key(kind, `var(${colour})`));
        if (lines.ellipses) box.append(key('ellipses: three standard deviations of the position', 'var(--blue)'));
        if (layer === 'class') ['', 'free', 'obstacle', 'cavity'].forEach((name, i) => name && box.append(key(name, `rgb(${kClasses[i]})`)));
        if (!span) return;
        const made = document.createElement('span'), bar = document.createElement('span');
        const text = value => `${value.toFixed(layer === 'sigma_m' ? 4 : 2)}${layer === 'cost' ? '' : ' m'}`;
        made.className = 'key';
        bar.className = 'ramp';
        bar.style.background = rampCss();
        made.append(text(span[0]), bar, text(span[1]));
        box.append(made);
      },
      state: () => ({drawn, vertices: terrain ? terrain.geometry.getAttribute('position').count : 0,
        triangles: terrain ? terrain.geometry.index.count / 3 : 0, time: now, rover: marker.position.toArray(),
        camera: camera.position.toArray(), target: controls.target.toArray(), lines: Object.keys(lines)}),
    };
    resize();
    return api;
  };
})();
