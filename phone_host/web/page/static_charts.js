// The script of static pages with charts. Prebuilt, with its styles, without uPlot, which stands before it: phone_host/report/page_charts.js. It takes all values from attributes
// (report/chart_view.py writes them) and loads nothing.

import { Chart } from './chart.js';
import chartStyle from './chart.css';
import plotStyle from './vendor/uplot.css';

const style = document.createElement('style');
style.textContent = plotStyle + chartStyle;
document.head.append(style);
for (const place of /** @type {NodeListOf<HTMLElement>} */ (document.querySelectorAll('[data-chart]'))) {
  const { unit, stacked, lines, columns } = JSON.parse(/** @type {string} */ (place.dataset.chart));
  place.replaceChildren();
  new Chart(place, unit, lines, stacked).set(columns);
}
