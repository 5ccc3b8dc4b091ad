#include "spartan/report/internal/page.h"

namespace spartan::internal {

// What plot_html.cpp writes: figure.plot > .legend > button.key[data-layer], svg.chart > .ticks, svg.area in units of
// the axes (y down), .marker, .scale.
const char* const kPlotScript = R"js(
'use strict';
(() => {
  const node = (name, attributes, text) => {
    const made = document.createElementNS('http://www.w3.org/2000/svg', name);
    for (const key in attributes) made.setAttribute(key, attributes[key]);
    if (text !== undefined) made.textContent = text;
    return made;
  };
  const step = (span, count) => {
    const raw = span / Math.max(count, 1), power = 10 ** Math.floor(Math.log10(raw));
    return [1, 2, 5, 10].map(factor => factor * power).find(value => raw <= value * 1.000001);
  };
  const ticks = (low, span, count) => {
    const by = step(span, count), list = [];
    for (let k = Math.ceil(low / by); k * by <= low + span; ++k) list.push(k * by);
    return list;
  };
  const text = value => String(+value.toPrecision(6));

  const enhance = plot => {
    const chart = plot.querySelector('.chart'), area = chart.querySelector('.area'), grid = chart.querySelector('.ticks');
    const [left, top, width, height] = ['x', 'y', 'width', 'height'].map(name => +area.getAttribute(name));
    const whole = area.getAttribute('viewBox').split(' ').map(Number);
    let view = [...whole];
    const px = x => left + (x - view[0]) / view[2] * width, py = y => top + (-y - view[1]) / view[3] * height;

    const drawTicks = () => {
      grid.replaceChildren();
      for (const x of ticks(view[0], view[2], width / 80)) {
        grid.append(node('path', {d: `M${px(x)} ${top}V${top + height}`}),
          node('text', {x: px(x), y: top + height + 18, 'text-anchor': 'middle'}, text(x)));
      }
      for (const y of ticks(-view[1] - view[3], view[3], height / 60)) {
        grid.append(node('path', {d: `M${left} ${py(y)}H${left + width}`}),
          node('text', {x: left - 6, y: py(y) + 4, 'text-anchor': 'end'}, text(y)));
      }
    };
    const drawScale = scale => {
      const most = view[2] / 3;
      let length = step(most, 1);
      if (length > most) length /= length / most > 2 ? 5 : 2;
      const right = +scale.dataset.right, y = +scale.dataset.y, from = right - length / view[2] * width;
      scale.querySelector('path').setAttribute('d', `M${from} ${y - 6}V${y}H${right}V${y - 6}`);
      const label = scale.querySelector('text');
      label.setAttribute('x', (from + right) / 2);
      label.textContent = `${text(length)} m`;
    };
    const draw = () => {
      area.setAttribute('viewBox', view.join(' '));
      drawTicks();
      for (const marker of chart.querySelectorAll('.marker')) {
        const x = px(+marker.dataset.x), y = py(+marker.dataset.y);
        const inside = x >= left && x <= left + width && y >= top && y <= top + height;
        marker.setAttribute('transform', `translate(${x} ${y})`);
        marker.style.visibility = inside ? '' : 'hidden';
      }
      chart.querySelectorAll('.scale').forEach(drawScale);
    };
    // Around (x, y), `factor` times as large.
    const zoom = (factor, x = view[0] + view[2] / 2, y = view[1] + view[3] / 2) => {
      view = [x - (x - view[0]) / factor, y - (y - view[1]) / factor, view[2] / factor, view[3] / factor];
      draw();
    };
    const at = event => {
      const box = chart.getBoundingClientRect(), scale = chart.viewBox.baseVal.width / box.width;
      return [(event.clientX - box.left) * scale, (event.clientY - box.top) * scale];
    };
    const axes = ([x, y]) => [view[0] + (x - left) / width * view[2], view[1] + (y - top) / height * view[3]];

    const keys = plot.querySelectorAll('button.key');
    for (const key of keys) {
      key.addEventListener('click', () => {
        const shown = key.getAttribute('aria-pressed') === 'false';
        key.setAttribute('aria-pressed', shown);
        for (const part of chart.querySelectorAll(`[data-layer="${key.dataset.layer}"]`)) part.style.display = shown ? '' : 'none';
      });
    }
    const buttons = document.createElement('span');
    buttons.className = 'zoom';
    for (const [label, name, action] of [['+', 'Zoom in', () => zoom(1.6)], ['−', 'Zoom out', () => zoom(1 / 1.6)],
      ['1:1', 'Whole plot', () => { view = [...whole]; draw(); }]]) {
      const button = document.createElement('button');
      button.type = 'button';
      button.textContent = label;
      button.title = name;
      button.setAttribute('aria-label', name);
      button.addEventListener('click', action);
      buttons.append(button);
    }
    plot.querySelector('.legend').append(buttons);

    const readout = document.createElement('span');
    readout.className = 'readout';
    chart.after(readout);
    const dot = node('circle', {r: 5, class: 'pointed', visibility: 'hidden'});
    chart.append(dot);
    const lines = [...area.querySelectorAll('.line')].map(line => ({line,
      name: [...keys].find(key => key.dataset.layer === line.dataset.layer).textContent,
      points: line.getAttribute('d').split(/[ML]/).slice(1).map(pair => pair.split(' ').map(Number))}));
    const point = event => {
      const [x, y] = at(event);
      let best, least = 900;
      for (const {line, name, points} of lines) {
        if (line.style.display === 'none') continue;
        for (const [u, v] of points) {
          const d = (px(u) - x) ** 2 + (py(-v) - y) ** 2;
          if (d < least) [least, best] = [d, {name, u, v: -v}];
        }
      }
      dot.setAttribute('visibility', best ? 'visible' : 'hidden');
      if (best) {
        dot.setAttribute('cx', px(best.u));
        dot.setAttribute('cy', py(best.v));
      }
      const [u, v] = axes([x, y]);
      readout.textContent = best ? `${best.name}: ${text(best.u)}, ${text(best.v)}` : `${u.toPrecision(4)}, ${(-v).toPrecision(4)}`;
    };

    let start, box;
    chart.addEventListener('pointerdown', event => {
      const [x, y] = at(event);
      if (event.pointerType !== 'mouse' || event.button !== 0) return;
      if (x < left || x > left + width || y < top || y > top + height) return;
      start = [x, y];
      chart.setPointerCapture(event.pointerId);
      event.preventDefault();
    });
    chart.addEventListener('pointermove', event => {
      point(event);
      if (!start) return;
      const [x, y] = at(event);
      if (!box) chart.append(box = node('rect', {class: 'box'}));
      const values = {x: Math.min(x, start[0]), y: Math.min(y, start[1]), width: Math.abs(x - start[0]), height: Math.abs(y - start[1])};
      for (const name in values) box.setAttribute(name, values[name]);
    });
    chart.addEventListener('pointerup', event => {
      if (!start) return;
      const [a, b] = [axes(start), axes(at(event))], spans = [Math.abs(a[0] - b[0]), Math.abs(a[1] - b[1])];
      start = undefined;
      if (box) box.remove();
      box = undefined;
      if (spans[0] < view[2] / 100 || spans[1] < view[3] / 100) return;
      const middle = [(a[0] + b[0]) / 2, (a[1] + b[1]) / 2];
      if (plot.dataset.equal) {
        const share = Math.max(spans[0] / view[2], spans[1] / view[3]);
        spans[0] = share * view[2];
        spans[1] = share * view[3];
      }
      view = [middle[0] - spans[0] / 2, middle[1] - spans[1] / 2, spans[0], spans[1]];
      draw();
    });
    chart.addEventListener('pointerleave', () => {
      dot.setAttribute('visibility', 'hidden');
      readout.textContent = '';
    });
    chart.addEventListener('dblclick', () => {
      view = [...whole];
      draw();
    });
    chart.addEventListener('wheel', event => {
      if (!event.ctrlKey && !event.metaKey) return;
      event.preventDefault();
      zoom(event.deltaY < 0 ? 1.25 : 0.8, ...axes(at(event)));
    }, {passive: false});
  };
  document.querySelectorAll('.plot').forEach(enhance);
})();
)js";

}  // namespace spartan::internal
